"""A run in the formats of other tools; importing this loads none of their libraries."""

from visualisation.exports.formats import FORMATS
from visualisation.exports.writing import Exported, default_path, export

__all__ = ["FORMATS", "Exported", "default_path", "export"]
