"""Runs in the formats of other tools; importing this loads none of their libraries."""

from visualisation.exports.formats import FORMATS, Exported, export, export_path

__all__ = ["FORMATS", "Exported", "export", "export_path"]
