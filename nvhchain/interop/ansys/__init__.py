"""Archives of Ansys MAPDL, written by CDWRITE."""
