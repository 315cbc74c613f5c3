"""Scenes of the studies whose membranes are forces: boxes, periodic all round or between walls that slide past each other."""

HEAD = """title = "{title}"
[time]
step_us = 10
end_us = {end}
[grid]
generator = "box"
nodes = {nodes}
lower_um = {lower}
upper_um = {upper}
[fluid]
convection = false
[coupling]
scheme = "force"
[contact]
[output]
every_us = {end}
history_every_us = {history}
fields = false
checkpoint_every_us = 0
"""
HALF_THICKNESS = 1.285     # um, of the resting cell's rim


def sides(walls, speed):
    """Periodic all round, or between walls across y that move with -+ `speed` mm/s."""
    text = ""
    for name in ("i", "j", "k"):
        for end, sign in (("min", -1), ("max", 1)):
            kind = (f'type = "moving_wall"\nvelocity_mm_per_s = [{sign * speed:g}, 0, 0]\n' if walls and name == "j"
                    else 'type = "periodic"\n')
            text += f'[[boundary]]\nside = "{name}_{end}"\n{kind}'
    return text


def box(title, size, spacing, cells, shear, end, history=0):
    """A case of a box of `size` um about the origin, sheared between walls at `shear` 1/s, or periodic all round where that is 0."""
    nodes = [round(s / spacing) + 1 for s in size]
    head = HEAD.format(title=title, end=end, nodes=nodes, lower=[-s / 2 for s in size], upper=[s / 2 for s in size], history=history)
    return head + sides(shear > 0, 5e-4 * shear * size[1]) + cells


def periods(size, shear):
    return (size[0], 0 if shear > 0 else size[1], size[2])


def red_cells(kind, vertices, more=""):
    """An entry of cells or of cell_types."""
    return f"[[{kind}]]\nvertices = {vertices}\nmembrane_viscosity_N_s_per_m = 0\n{more}"


def one_aslant(vertices):
    return red_cells("cells", vertices, "center_um = [0, 0, 0]\naxis = [0.5, 1, 0.2]\n")


def two_face_to_face(vertices, gap_um, push_nN):
    """Rims `gap_um` apart, and pressed."""
    both = red_cells("cell_types", vertices, 'name = "rbc"\n')
    for sign in (-1, 1):
        both += (f'[[cells]]\ntype = "rbc"\ncenter_um = [0, 0, {sign * (0.5 * gap_um + HALF_THICKNESS):.6g}]\n'
                 f"spin_deg = {17 if sign > 0 else 0}\npush_nN = [0, 0, {-sign * push_nN:g}]\n")
    return both


def population(vertices, hematocrit):
    return red_cells("cell_types", vertices, 'name = "rbc"\n') + f'[[populations]]\ntype = "rbc"\nhematocrit = {hematocrit:g}\nseed = 1\n'


def placed(vertices, places):
    """`places`: of each cell its center, um, and axis."""
    text = red_cells("cell_types", vertices, 'name = "rbc"\n')
    return text + "".join(f'[[cells]]\ntype = "rbc"\ncenter_um = {list(center)}\naxis = {list(axis)}\n' for center, axis in places)
