// Somebody else's node: Fast DDS, by types that fastddsgen makes of IDL. Loopback only, no multicast.
//
//     fast_dds_peer DOMAIN echo       answers each odometry with an array: position, quaternion, stamp in s
//     fast_dds_peer DOMAIN garbage    sends bytes that hold no odometry, under the name of its type

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "messagesPubSubTypes.h"

using namespace eprosima::fastdds::dds;
using Odometry = nav_msgs::msg::dds_::Odometry_;
using Array = std_msgs::msg::dds_::Float64MultiArray_;

// Bytes under another type's name.
class Garbage : public PlainBytesPubSubType {
public:
    Garbage() { setName("nav_msgs::msg::dds_::Odometry_"); }
};

class Echo : public DataReaderListener {
public:
    explicit Echo(DataWriter* writer) : writer_(writer) {}

    void on_data_available(DataReader* reader) override {
        Odometry odometry;
        SampleInfo info;
        while (reader->take_next_sample(&odometry, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            const auto& pose = odometry.pose().pose();
            const auto& stamp = odometry.header().stamp();
            Array answer;
            answer.data({pose.position().x(), pose.position().y(), pose.position().z(), pose.orientation().x(),
                         pose.orientation().y(), pose.orientation().z(), pose.orientation().w(),
                         stamp.sec() + 1e-9 * stamp.nanosec()});
            writer_->write(&answer);
        }
    }

private:
    DataWriter* writer_;
};

static DomainParticipant* participant(int domain) {
    DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    for (int index = 0; index < 10; ++index) {  // ports of the first participants of a domain, RTPS 2.3, 9.6.1
        eprosima::fastrtps::rtps::Locator_t peer;
        eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, "127.0.0.1");
        peer.port = 7400 + 250 * domain + 10 + 2 * index;
        qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    }
    return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

static DataWriter* writer(DomainParticipant* node, const std::string& name, TypeSupport type) {
    type.register_type(node);
    Topic* topic = node->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT);
    DataWriterQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    return node->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
}

static int echo(DomainParticipant* node) {
    Echo listener(writer(node, "rt/thrusters", TypeSupport(new std_msgs::msg::dds_::Float64MultiArray_PubSubType())));
    TypeSupport type(new nav_msgs::msg::dds_::Odometry_PubSubType());
    type.register_type(node);
    Topic* topic = node->create_topic("rt/odom", type.get_type_name(), TOPIC_QOS_DEFAULT);
    DataReaderQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    node->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos, &listener);
    std::cout << "ready" << std::endl;
    std::string line;
    while (std::getline(std::cin, line)) {  // until the other side closes the pipe
    }
    return 0;
}

static int garbage(DomainParticipant* node) {
    DataWriter* out = writer(node, "rt/odom", TypeSupport(new Garbage()));
    std::cout << "ready" << std::endl;
    std::string line;
    std::getline(std::cin, line);  // the other side is there
    PlainBytes message;
    std::srand(7);
    for (int count = 0; count < 200; ++count) {
        message.numbers().resize(std::rand() % 900);
        for (auto& byte : message.numbers()) byte = std::rand() % 256;
        out->write(&message);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const bool arrived = out->wait_for_acknowledgments({10, 0}) == ReturnCode_t::RETCODE_OK;
    std::cout << (arrived ? "arrived" : "lost") << std::endl;
    std::getline(std::cin, line);
    return 0;
}

int main(int count, char** arguments) {
    DomainParticipant* node = count == 3 ? participant(std::atoi(arguments[1])) : nullptr;
    if (node == nullptr) return 1;
    return std::string(arguments[2]) == "echo" ? echo(node) : garbage(node);
}
