// Readers of clouds. `content` is the whole file; `name` appears in error texts; array: colours the points, as for
// scene::choose_array(); empty: no array. No memory is allocated by a count that a file merely claims.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/cloud/cloud.h"

namespace telesplat::data {

using ReadCloud = Result<std::shared_ptr<const SquareCloud>>;

/// Reads LAS 1.0 to 1.4, point formats 0 to 10; compressed ones (LAZ, COPC) without wave packets; extra bytes; withheld
/// points are left out. Source: ASPRS, "LAS Specification 1.4 - R15", 2019. most_points: if there are more, every n-th
/// one is read; of very many compressed ones, every n-th of the first ones of each chunk.
ReadCloud read_las(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array = {}, uint64_t most_points = kMaxPoints);
/// Reads an EPT folder, whose file ept.json this is, and the files in it: points as laszip, binary or zstandard.
ReadCloud read_ept(std::string_view content, const std::string& path, const ReadProgress& progress,
                   const std::string& array = {});
/// Returns the files that an ept.json needs, relative to its folder; files that cannot be read name none.
std::vector<std::string> ept_files(std::string_view content, const std::string& path);
/// Reads E57 1.0: places in either kind of coordinates, poses, colours, intensity and other numbers; points that the
/// scanner did not measure are left out. most_points: every n-th point is read if there are more.
ReadCloud read_e57(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array = {}, uint64_t most_points = kMaxPoints);
/// Reads PCD 0.5 to 0.7: text, binary, compressed; fields named _ are left out; a field of several numbers is as many
/// arrays. Source: R. Rusu, "The PCD (Point Cloud Data) file format", pointclouds.org.
ReadCloud read_pcd(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array = {});
/// Reads PTX: scans with their scanner's place and pose; points 0 0 0 were not measured, and are left out.
ReadCloud read_ptx(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array = {});
/// Reads lines of numbers, separated by blanks, commas or semicolons (XYZ, PTS, CSV): x y z, then what a line of names
/// says; without one: 1 more number is the intensity; 3 are red green blue if whole and up to 255, a normal if their
/// length is 1; 4 are intensity and colour; others are arrays. Lines of one number (PTS) are counts. Comments start
/// with # or //.
ReadCloud read_xyz(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array = {});

/// True if the points of a LAS file are compressed.
bool is_packed_las(std::string_view content);
/// True if the text is a PTX, or lines that read_xyz() reads. regular_grid: it has three columns, and its first
/// points follow each other in steps of a raster: along a row, and to the next row.
bool is_ptx(std::string_view content);
bool is_xyz(std::string_view content, bool* regular_grid = nullptr);

}  // namespace telesplat::data
