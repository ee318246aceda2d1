"""Contact of loaded flanks: contact lines, local deformation, tip edges and friction."""
