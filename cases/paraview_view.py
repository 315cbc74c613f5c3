"""Draw a run in ParaView: speed of the plasma on the plane y = 0, and the cells at the start, the middle and the end.

    pvpython cases/paraview_view.py RUN_DIR [PICTURE.png]

On a machine without a display: xvfb-run -a pvpython ... Also a start for scripts of your own: fields.xdmf and cells.xdmf are
time series; times are in us, lengths in um.
"""
import sys

from paraview.simple import (Calculator, ColorBy, CreateView, ExtractSurface, ExtractTimeSteps, GenerateSurfaceNormals,
                             GetColorTransferFunction, GetScalarBar, Render, SaveScreenshot, Show, Slice, XDMFReader)


def reader(path):
    data = XDMFReader(FileNames=[path])
    data.UpdatePipelineInformation()
    return data, list(data.TimestepValues)


def show_cell(view, cells, number, colour):
    at = ExtractTimeSteps(Input=cells, TimeStepIndices=[number])
    display = Show(GenerateSurfaceNormals(Input=ExtractSurface(Input=at)), view)
    display.ColorArrayName = ["POINTS", ""]
    display.AmbientColor = display.DiffuseColor = colour
    display.Specular = 0.4


def main(folder, picture):
    fields, times = reader(f"{folder}/fields.xdmf")
    cells, cell_times = reader(f"{folder}/cells.xdmf")
    print(f"{len(times)} times of fields, {len(cell_times)} of cells, {times[0]:g} to {times[-1]:g} us")
    view = CreateView("RenderView")
    view.ViewSize = [1500, 520]
    view.Background = [1, 1, 1]
    view.UseColorPaletteForBackground = 0
    view.OrientationAxesVisibility = 0
    view.ViewTime = times[-1]
    plane = Slice(Input=fields)
    plane.SliceType.Normal = [0, 1, 0]
    speed = Calculator(Input=plane, AttributeType="Cell Data", ResultArrayName="speed, mm/s",
                       Function="1000 * mag(velocity_um_per_us)")
    display = Show(speed, view)
    ColorBy(display, ("CELLS", "speed, mm/s"))
    display.Ambient, display.Diffuse = 1, 0
    display.RescaleTransferFunctionToDataRange(False)
    colours = GetColorTransferFunction("speed, mm/s")
    colours.ApplyPreset("Viridis (matplotlib)", True)
    bar = GetScalarBar(colours, view)
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    bar.Title, bar.ComponentTitle = "speed, mm/s", ""
    bar.Orientation, bar.WindowLocation, bar.Position = "Horizontal", "Any Location", [0.34, 0.04]
    display.SetScalarBarVisibility(view, True)
    last = len(cell_times) - 1
    for number, colour in zip((0, last // 2, last), ([0.95, 0.75, 0.7], [0.9, 0.4, 0.35], [0.75, 0.05, 0.05])):
        show_cell(view, cells, number, colour)
    view.CameraFocalPoint = [0, 0, 0]
    view.CameraPosition = [14, 60, 10]
    view.CameraViewUp = [1, 0, 0]
    Render(view)
    view.ResetCamera(False)
    view.CameraParallelProjection = 1
    view.CameraParallelScale = 9
    SaveScreenshot(picture, view)
    print(picture)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2] if len(sys.argv) == 3 else f"{sys.argv[1]}/paraview.png")
