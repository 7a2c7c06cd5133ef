"""Figures 2 and 6 to 13 of the paper, from runs of its two examples."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures.effort import effort
from undertow.report.figures.identification import identification
from undertow.report.figures.robust_term import robust_term
from undertow.report.figures.thruster_laws import thruster_laws
from undertow.report.figures.tracking import tracking
from undertow.report.figures.uncertainty import uncertainty
from undertow.reproduction.thruster_response import ThrusterResponse


def paper_figures(
    example1: Mapping[str, xr.Dataset], example2: Mapping[str, xr.Dataset], response: ThrusterResponse
) -> dict[str, Figure]:
    """The paper's figures by name: fig02, fig06, ..., fig13.

    Args:
        example1: runs of Example 1 by controller, `rcafc` and `rafc`.
        example2: runs of Example 2; as in the paper, only `rcafc` is plotted.
        response: the response of the thruster to a slow and a fast voltage.
    """
    both = {key: example1[key] for key in ("rcafc", "rafc")}
    alone = {"rcafc": example2["rcafc"]}
    return {
        "fig02": thruster_laws(response),
        "fig06": tracking("Fig. 6  Example 1: tracking", both),
        "fig07": uncertainty("Fig. 7  Example 1: lumped uncertainty and its estimates", both),
        "fig08": robust_term("Fig. 8  Example 1: robust term", both),
        "fig09": effort("Fig. 9  Example 1: control voltages", both),
        "fig10": tracking("Fig. 10  Example 2: tracking", alone),
        "fig11": identification("Fig. 11  Example 2: state and series-parallel state", alone["rcafc"]),
        "fig12": uncertainty("Fig. 12  Example 2: lumped uncertainty and its estimate", alone),
        "fig13": effort("Fig. 13  Example 2: control voltages", alone),
    }
