"""Commands that are interrupted, files and cases that are damaged, disks that are full, processes that run long."""
