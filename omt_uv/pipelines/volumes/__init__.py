"""Moves and maps of bodies: what the operators and commands of flows and volumes share, from arrays to arrays.

Imports solver.flows, solver.volumes and errors.
Main names: FlowBody, FlowJob, flow_bodies, flow_uvs, handles_of, read_handle_file, mapped_volume.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    flow="FlowBody FlowJob FlowResult UVPlaces flow_bodies flow_uvs",
    volume="MappedVolume VolumeBody VolumeSettings mapped_volume",
    vtu="vtu_text",
    handle_file="HandleFileError handles_of read_handle_file",
)
