// Workload W1 in scalar C++, as it would be written by hand: the yardstick for the speed of undertow's batches.
//
// ODIN with eight electromechanical motors under the paper's sensorless law (RCAFC), suite U1, control at 1 kHz with
// the input held, one Runge-Kutta step of the plant per control step. benchmarks/yardstick.py writes w1_constants.h
// from undertow's own vehicle, motor and gains, so that no number of them is typed twice, compiles this file, compares
// its results with undertow's, and measures its time. Equation numbers are those of the paper.
//
//     w1 trajectory STEPS    time, outputs and voltages of each control step, one line each
//     w1 metrics STEPS RUNS  metrics over the second half of a run, one `name value` per line, and the shortest
//                            processor time of a step, ns, of so many equal runs
//
// The attitude is a unit quaternion, so that the plant needs no trigonometry. Stages of the integrator at the same time
// share the load, and metrics are computed inside their window only, with the acceleration of the first stage.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <numeric>
#include <string>

template <std::size_t N>
using Vector = std::array<double, N>;
template <std::size_t Rows, std::size_t Columns>
using Matrix = std::array<std::array<double, Columns>, Rows>;

#include "w1_constants.h"

using Vector3 = Vector<3>;
using Vector6 = Vector<6>;
using PerThruster = Vector<THRUSTERS>;
using Weights = Matrix<6, SETS>;

template <std::size_t Rows, std::size_t Columns>
inline Vector<Rows> product(const Matrix<Rows, Columns>& a, const Vector<Columns>& x) {
    Vector<Rows> y;
    for (std::size_t i = 0; i < Rows; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < Columns; ++j) sum += a[i][j] * x[j];
        y[i] = sum;
    }
    return y;
}

inline Vector3 cross(const double* a, const double* b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double square(double x) { return x * x; }

// Suite U1, m/s^2 and rad/s^2; its formulas are those of undertow/disturbances/u1.py.
inline Vector6 suite_u1(double t) {
    const double turns = t / 10.0;
    return {
        4.0 * std::sin(t) + (t >= 8.0 ? 6.0 : 0.0) - (t >= 14.0 ? 9.0 : 0.0),
        3.0 * std::sin(2.0 * t) + 2.0 * std::sin(20.0 * t),
        -3.0 + 2.0 * std::sin(0.5 * t) + (std::sin(PI / 2 * t) >= 0.0 ? 3.0 : -3.0),
        2.0 * std::sin(3.0 * t) + (t >= 6.0 ? 4.0 : 0.0) - (t >= 10.0 ? 4.0 : 0.0),
        4.0 * (turns - std::floor(turns)),
        2.0 * std::sin(0.25 * t * t),
    };
}

// Rotation R from body to world axes and the Jacobian J = diag(R, T) of Eq. (1), whose T is that of the Euler angles.
struct Kinematics {
    Matrix<3, 3> r;
    double cos_pitch, secant, tan_pitch, sin_roll, cos_roll;

    explicit Kinematics(const Vector<4>& q) {
        const auto [w, x, y, z] = q;
        r = {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
              {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
              {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
        cos_pitch = std::sqrt(square(r[2][1]) + square(r[2][2]));
        secant = 1.0 / cos_pitch;
        tan_pitch = -r[2][0] * secant;
        sin_roll = r[2][1] * secant;
        cos_roll = r[2][2] * secant;
    }

    Vector3 euler_angles() const {
        return {std::atan2(r[2][1], r[2][2]), std::atan2(-r[2][0], cos_pitch), std::atan2(r[1][0], r[0][0])};
    }

    Vector6 to_world(const Vector6& nu) const {  // J nu
        const double across = sin_roll * nu[4] + cos_roll * nu[5];
        return {r[0][0] * nu[0] + r[0][1] * nu[1] + r[0][2] * nu[2],
                r[1][0] * nu[0] + r[1][1] * nu[1] + r[1][2] * nu[2],
                r[2][0] * nu[0] + r[2][1] * nu[1] + r[2][2] * nu[2],
                nu[3] + tan_pitch * across, cos_roll * nu[4] - sin_roll * nu[5], secant * across};
    }

    Vector6 to_body(const Vector6& a) const {  // J^-1 a
        return {r[0][0] * a[0] + r[1][0] * a[1] + r[2][0] * a[2],
                r[0][1] * a[0] + r[1][1] * a[1] + r[2][1] * a[2],
                r[0][2] * a[0] + r[1][2] * a[1] + r[2][2] * a[2],
                a[3] + r[2][0] * a[5], cos_roll * a[4] + r[2][1] * a[5], -sin_roll * a[4] + r[2][2] * a[5]};
    }

    Vector6 rate_term(const Vector6& nu) const {  // J_dot nu
        const double across = sin_roll * nu[4] + cos_roll * nu[5];
        const double pitch_rate = cos_roll * nu[4] - sin_roll * nu[5];
        const double roll_rate = nu[3] + tan_pitch * across;
        const Vector3 turning = cross(&nu[3], &nu[0]);
        Vector6 found = to_world({turning[0], turning[1], turning[2], 0.0, 0.0, 0.0});
        found[3] = pitch_rate * across * square(secant) + tan_pitch * roll_rate * pitch_rate;
        found[4] = -roll_rate * across;
        found[5] = (roll_rate * pitch_rate + tan_pitch * pitch_rate * across) * secant;
        return found;
    }
};

// -C(nu) nu - D(nu) nu - g of Eq. (2), N and N m. ODIN's damping matrices are diagonal.
inline Vector6 hull_forces(const Kinematics& at, const Vector6& nu) {
    const Vector6 p = product(MASS, nu);
    const Vector3 force = cross(&nu[3], &p[0]);
    const Vector3 moment = cross(&nu[0], &p[0]);
    const Vector3 turning = cross(&nu[3], &p[3]);
    const auto& down = at.r[2];
    const Vector3 righting = cross(RIGHTING_LEVER.data(), down.data());
    Vector6 found;
    for (int i = 0; i < 3; ++i) {
        found[i] = NET_WEIGHT * down[i] - force[i];
        found[i + 3] = righting[i] - moment[i] - turning[i];
    }
    for (int i = 0; i < 6; ++i) found[i] -= (LINEAR_DAMPING[i] + QUADRATIC_DAMPING[i] * std::abs(nu[i])) * nu[i];
    return found;
}

struct State {
    Vector3 position;    // m, world axes
    Vector<4> attitude;  // unit quaternion, body to world
    Vector6 nu;          // m/s, rad/s, body axes
    PerThruster speed;   // rad/s
    PerThruster current; // A
};

// Rates of the plant with voltages held: Eqs. (1), (2), (6), (8)-(11), with the load added to x_ddot.
inline State rates(const State& x, const PerThruster& voltage, const Vector6& load) {
    const Kinematics at(x.attitude);
    State d;
    PerThruster thrust;
    for (std::size_t j = 0; j < THRUSTERS; ++j) {
        const double signed_square = x.speed[j] * std::abs(x.speed[j]);
        thrust[j] = C_T * signed_square;
        d.speed[j] = (K_T * x.current[j] - K_F * x.speed[j] - C_Q * signed_square) * (1.0 / J_ROTOR);
        d.current[j] = (voltage[j] - R * x.current[j] - K_E * x.speed[j]) * (1.0 / L);
    }
    Vector6 wrench = product(THRUSTER_MATRIX, thrust);
    const Vector6 hull = hull_forces(at, x.nu);
    for (int i = 0; i < 6; ++i) wrench[i] += hull[i];
    d.nu = product(INVERSE_MASS, wrench);
    const Vector6 prescribed = at.to_body(load), velocity = at.to_world(x.nu);
    for (int i = 0; i < 6; ++i) d.nu[i] += prescribed[i];
    for (int i = 0; i < 3; ++i) d.position[i] = velocity[i];
    const auto [w, i, j, k] = x.attitude;
    const double p = x.nu[3], q = x.nu[4], r = x.nu[5];
    // The second term returns the quaternion to unit length at a rate of 1/s.
    const double longer = 0.5 * (1.0 - (w * w + i * i + j * j + k * k));
    d.attitude = {0.5 * (-i * p - j * q - k * r) + longer * w, 0.5 * (w * p + j * r - k * q) + longer * i,
                  0.5 * (w * q + k * p - i * r) + longer * j, 0.5 * (w * r + i * q - j * p) + longer * k};
    return d;
}

template <std::size_t N>
inline void add(Vector<N>& y, double h, const Vector<N>& slope) {
    for (std::size_t i = 0; i < N; ++i) y[i] += h * slope[i];
}

inline State moved(State x, double h, const State& d) {
    add(x.position, h, d.position);
    add(x.attitude, h, d.attitude);
    add(x.nu, h, d.nu);
    add(x.speed, h, d.speed);
    add(x.current, h, d.current);
    return x;
}

// The rest of a classical Runge-Kutta step after its first stage. Times are moved into the step by a share INWARD of
// it, so that a load that jumps at a control step has jumped, as in undertow/numerics/integrators.py.
inline State runge_kutta(double t, const State& x, const State& k1, const PerThruster& voltage) {
    const Vector6 middle = suite_u1(t + DT / 2);
    const State k2 = rates(moved(x, DT / 2, k1), voltage, middle);
    const State k3 = rates(moved(x, DT / 2, k2), voltage, middle);
    const State k4 = rates(moved(x, DT, k3), voltage, suite_u1(t + DT - INWARD * DT));
    return moved(moved(moved(moved(x, DT / 6, k1), DT / 3, k2), DT / 3, k3), DT / 6, k4);
}

// What the law measures: outputs x = (north, east, down, roll, pitch, yaw) and their rates, body velocity and attitude.
struct Measurement {
    Kinematics at;
    Vector6 nu, outputs, rates;

    explicit Measurement(const State& x) : at(x.attitude), nu(x.nu), rates(at.to_world(x.nu)) {
        const Vector3 angles = at.euler_angles();
        for (int i = 0; i < 3; ++i) {
            outputs[i] = x.position[i];
            outputs[i + 3] = angles[i];
        }
    }
};

// The fuzzy basis xi of Eq. (37). Sets are evenly spaced and of one width, so one exponential does: relative to the
// outermost set on the side of eps, the set l steps further in weighs ratio^l INWARD_WEIGHT[l].
inline Vector<SETS> fuzzy_basis(double eps) {
    const double ratio = std::exp(BASIS_SLOPE * (OUTERMOST - std::abs(eps)));
    Vector<SETS> xi;
    double power = 1.0, sum = 0.0;
    for (std::size_t l = 0; l < SETS; ++l) {
        xi[l] = power * INWARD_WEIGHT[l];
        power *= ratio;
        sum += xi[l];
    }
    const double scale = 1.0 / sum;
    for (double& share : xi) share *= scale;
    if (eps >= 0.0) std::reverse(xi.begin(), xi.end());
    return xi;
}

// RCAFC. `command` gives the voltages and keeps what the others need: the law advances once an input has been applied.
struct Law {
    Vector6 predicted_velocity{};  // x_hat_dot, m/s, rad/s
    Weights theta{};

    Vector6 error, eps, estimate, robust, drift, filtered;
    Weights xi;

    PerThruster command(const Measurement& y) {
        const Vector6 free = product(INVERSE_MASS, hull_forces(y.at, y.nu));
        drift = y.at.to_world(free);  // F of Eq. (17)
        Vector6 desired;
        for (int i = 0; i < 6; ++i) {
            error[i] = TARGET[i] - y.outputs[i];
            if (i >= 3) error[i] -= 2 * PI * std::nearbyint(error[i] * (1 / (2 * PI)));
            filtered[i] = P_12 * error[i] - P_22 * y.rates[i];
            robust[i] = ROBUST_GAIN * std::tanh(filtered[i] * (1 / LAYER));  // Eq. (43)
            eps[i] = predicted_velocity[i] - y.rates[i];                     // Eq. (31)
            xi[i] = fuzzy_basis(eps[i]);
            estimate[i] = 0.0;  // Eq. (42)
            for (std::size_t l = 0; l < SETS; ++l) estimate[i] += theta[i][l] * xi[i][l];
            desired[i] = -drift[i] - estimate[i] + K_1 * error[i] - K_2 * y.rates[i] + robust[i];
        }
        return product(VOLTAGE_PER_ACCELERATION, y.at.to_body(desired));  // Eq. (23): G+ = (B alpha)+ M J^-1
    }

    Vector6 known(const Measurement& y, const PerThruster& applied) const {  // F + G V
        Vector6 found = y.at.to_world(product(ACCELERATION_PER_VOLT, applied));
        for (int i = 0; i < 6; ++i) found[i] += drift[i];
        return found;
    }

    // Eqs. (32) and (44) over one sampling time by Euler's method; weights are projected into their box.
    void advance(const Vector6& known) {
        for (int i = 0; i < 6; ++i) {
            const double compensation = COMPENSATION_GAIN * std::tanh(eps[i] * (1 / COMPENSATION_LAYER));
            predicted_velocity[i] += DT * (-POLE * eps[i] + known[i] + estimate[i] - compensation);
            const double rate = -ADAPTATION * (filtered[i] + COMPOSITE * eps[i]);
            for (std::size_t l = 0; l < SETS; ++l)
                theta[i][l] = std::clamp(theta[i][l] + DT * rate * xi[i][l], -WEIGHTS_BOUND, WEIGHTS_BOUND);
        }
    }
};

void say(const std::string& name, double value) { std::printf("%s %.17g\n", name.c_str(), value); }

// The metrics of undertow/analysis/metrics.py: those of the window, and the settling time.
struct Metrics {
    int samples = 0;
    Vector6 error{}, estimation{}, uncertainty{}, robust{}, model{};  // sums of squares
    Vector6 largest_error{}, weights_peak{}, settled{};
    double input_squares = 0, input_peak = 0, variation = 0, energy = 0, power_before = 0;
    PerThruster input_before{};

    void settle(double t, const Law& law) {  // the vehicle starts at zero
        for (int i = 0; i < 6; ++i)
            if (std::abs(law.error[i]) > SETTLED * std::abs(TARGET[i])) settled[i] = t;
    }

    void update(const State& x, const Law& law, const PerThruster& input, const Vector6& d) {
        for (int i = 0; i < 6; ++i) {
            error[i] += square(law.error[i]);
            estimation[i] += square(law.estimate[i] - d[i]);
            uncertainty[i] += square(d[i]);
            robust[i] += square(law.robust[i]);
            model[i] += square(law.eps[i]);
            largest_error[i] = std::max(largest_error[i], std::abs(law.error[i]));
            for (double weight : law.theta[i]) weights_peak[i] = std::max(weights_peak[i], std::abs(weight));
        }
        double squares = 0, change = 0, power = 0;
        for (std::size_t j = 0; j < THRUSTERS; ++j) {
            squares += square(input[j]);
            change += std::abs(input[j] - input_before[j]);
            input_peak = std::max(input_peak, std::abs(input[j]));
            power += input[j] * x.current[j];
        }
        input_squares += squares / THRUSTERS;
        if (samples > 0) {
            variation += change / THRUSTERS;
            energy += DT * (power + power_before) / 2;
        }
        input_before = input;
        power_before = power;
        ++samples;
    }

    void print() const {
        for (int g = 0; g < 2; ++g) {
            const std::string group = g == 0 ? "position" : "attitude";
            const auto rms = [&](const Vector6& sums) {
                return std::sqrt((sums[3 * g] + sums[3 * g + 1] + sums[3 * g + 2]) / (3.0 * samples));
            };
            const auto largest = [&](const Vector6& one) { return *std::max_element(&one[3 * g], &one[3 * g] + 3); };
            say(group + "_rms", rms(error));
            say(group + "_estimation_rms", rms(estimation));
            say(group + "_uncertainty_rms", rms(uncertainty));
            say(group + "_robust_rms", rms(robust));
            say(group + "_model_rms", rms(model));
            say(group + "_max", largest(largest_error));
            say(group + "_weights_peak", largest(weights_peak));
        }
        say("tracking_rms", std::sqrt(std::accumulate(error.begin(), error.end(), 0.0) / (6.0 * samples)));
        say("input_rms", std::sqrt(input_squares / samples));
        say("input_peak", input_peak);
        say("input_variation", variation / (DT * (samples - 1)));
        say("energy", energy);
        say("settling_time", *std::max_element(settled.begin(), settled.end()));
    }
};

// Whether a run can go on: the state is finite and within the plausible range, and Euler angles are defined.
inline bool valid(const State& x) {
    bool inside = true;
    for (double one : x.position) inside &= std::abs(one) < ENVELOPE;
    for (double one : x.nu) inside &= std::abs(one) < ENVELOPE;
    return inside && Kinematics(x.attitude).cos_pitch > LEAST_COSINE;
}

// A run of so many steps; `record` is called with time, measurement and voltages of each.
template <class Record>
Metrics run(int steps, Record record) {
    State x{};
    x.attitude = {1.0, 0.0, 0.0, 0.0};
    Law law;
    Metrics metrics;
    for (int k = 0; k < steps; ++k) {
        const double t = k * DT;
        const Measurement y(x);
        const PerThruster voltage = law.command(y);
        record(t, y, voltage);
        const Vector6 known = law.known(y, voltage);
        const State first = rates(x, voltage, suite_u1(t + INWARD * DT));
        metrics.settle(t, law);
        if (k >= steps / 2) {
            Vector6 d = y.at.to_world(first.nu);  // x_ddot - F - G V
            const Vector6 turning = y.at.rate_term(x.nu);
            for (int i = 0; i < 6; ++i) d[i] += turning[i] - known[i];
            metrics.update(x, law, voltage, d);
        }
        law.advance(known);
        x = runge_kutta(t, x, first, voltage);
        if (!valid(x)) {
            std::fprintf(stderr, "The run failed at %g s.\n", t + DT);
            std::exit(1);
        }
    }
    return metrics;
}

int main(int count, char** words) {
    const auto number = [&](int i) { return i < count ? std::atoi(words[i]) : 0; };
    const std::string asked = count > 1 ? words[1] : "";
    const int steps = number(2);
    if (asked == "trajectory" && steps > 0) {
        run(steps, [](double t, const Measurement& y, const PerThruster& voltage) {
            std::printf("%.17g", t);
            for (double one : y.outputs) std::printf(" %.17g", one);
            for (double one : voltage) std::printf(" %.17g", one);
            std::printf("\n");
        });
        return 0;
    }
    if (asked == "metrics" && steps > 0 && number(3) > 0) {
        double shortest = std::numeric_limits<double>::infinity();
        Metrics found;  // printed, so that the compiler cannot leave out any of them
        for (int i = 0; i < number(3); ++i) {
            const std::clock_t begun = std::clock();
            found = run(steps, [](double, const Measurement&, const PerThruster&) {});
            shortest = std::min(shortest, static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC);
        }
        found.print();
        say("ns_per_step", 1e9 * shortest / steps);
        return 0;
    }
    std::fprintf(stderr, "Usage: w1 trajectory STEPS | w1 metrics STEPS RUNS\n");
    return 2;
}
