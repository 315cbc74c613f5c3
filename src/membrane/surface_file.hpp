// A body's surface from a file: read, checked, scaled and turned as the case asks, with what the user should know of it.
#pragma once

#include "membrane/mesh.hpp"

namespace corpuscle {

struct FileSurface {
  TriangleMesh mesh;   // ready to be placed: its origin goes to center_um, its z to `axis`
  Triple extent_um{};  // along the file's axes, scaled
  double area_um2 = 0, volume_um3 = 0;
  Triple centroid_um{};                      // of the enclosed volume, from the file's origin, scaled
  bool disc = false;                         // flat in one direction, and so with an axis of its own
  Triple axis{0, 0, 1};                      // of the disc, in the file
  double diameter_um = 0, thickness_um = 0;  // of the disc: mean extent across the axis, extent along it
  std::vector<std::string> notes, warnings;  // what was put right; what was changed that may not have been meant
};

/// For a cell, largest extent 1 to 100 um. With `recenter` the centroid of the volume becomes the origin, with `align`
/// the axis of a disc becomes z.
/// @throws InputError  for a damaged file, a surface that is not one closed surface, or passes through itself, or a size
///                     that is not a cell's (naming the scale that would make it one)
FileSurface read_cell_surface(const CellSettings& cell);

/// For a rigid body: with `recenter` as above, never turned.
FileSurface read_body_surface(const BodySettings& body);

/// The power of ten that brings `extent` nearest to `wanted`.
double nearest_scale(double extent, double wanted);

/// " (a file in mm)" for a scale that turns a common unit into um, or "".
const char* unit_of_scale(double scale);

}  // namespace corpuscle
