"""Abaqus input file of one element that several tests read."""

ABAQUS = """\
*HEADING
*PART, NAME=Case
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
*ELEMENT, TYPE=C3D8R, ELSET=All
1, 1, 2, 3, 4,
5, 6, 7, 8
*NSET, NSET=bottom, GENERATE
1, 4, 1
*SOLID SECTION, ELSET=all, MATERIAL=Steel
,
*END PART
*ASSEMBLY, NAME=Assembly
*INSTANCE, NAME=Case-1, PART=Case
*END INSTANCE
*NODE
1, 2., 0.5, 0.5
*NSET, NSET=Ref
1,
*NSET, NSET=corner, INSTANCE=Case-1
8,
*ELSET, ELSET=seat, INSTANCE=Case-1
1
*SURFACE, TYPE=ELEMENT, NAME=Seat
seat, S4
*COUPLING, CONSTRAINT NAME=A1, REF NODE=Ref, SURFACE=Seat
*KINEMATIC
*END ASSEMBLY
*MATERIAL, NAME=Steel
*DENSITY
7.85e-09,
*ELASTIC
210000., 0.3
*BOUNDARY
bottom, PINNED
Case-1.8, 3, 3
*STEP
*END STEP
"""
