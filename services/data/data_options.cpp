#include "services/data/data_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "common/colour/colour_map.h"
#include "common/volume/transfer/function.h"
#include "services/data/kinds.h"
#include "services/data/mesh/reader.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {
namespace {

using options::Names;
using options::Range;
using options::Reach;
using options::Table;
using scene::Kind;
using scene::Kinds;

constexpr Kinds kMeshes{Kind::kMesh}, kVolumes{Kind::kVolume};
constexpr Kinds kVolumesAndTheirSurfaces{Kind::kVolume, Kind::kMesh}, kFiles = kVolumesAndTheirSurfaces;

// Makes the path absolute, because a run's session.toml names the folder.
options::Text folder(std::string& path) {
  return {[&path](const std::string& text) {
            std::error_code error;
            path = text.empty() ? text : std::filesystem::absolute(text, error).string();
            return error ? Status(Error{error.message()}) : ok_status();
          },
          [&path] { return path; }};
}

std::string transfer_names() {
  std::string out;
  for (const auto& preset : volume::transfer_presets())
    out += fmt::format("{}{}", out.empty() ? "" : ", ", preset.name);
  return out;
}

Table grouped(Table table, const std::string& group) {
  for (options::Row& row : table) row.group = group;
  return table;
}

Table recorded(Table table) {
  for (options::Row& row : table) row.reach = Reach::kRecorded;
  return table;
}

Table placement_table(PlacementOptions& o) {
  return {
      {.flag = "--room-size",
       .value = &o.room_size_m,
       .help = "largest extent of the data set in room space, metres",
       .limits = Range{1e-3, 1e3}},
      {.flag = "--up",
       .value = &o.up,
       .help = "data axis that points up",
       .limits = Names{"auto", "x", "y", "z", "-x", "-y", "-z"},
       .fits = kFiles},
  };
}

Table mesh_table(MeshOptions& o) {
  return {
      {.flag = "--crease-angle",
       .value = &o.crease_deg,
       .help = "meshes without normals, but terrains and scans: edges are sharp from this angle on, degrees; 180: none",
       .limits = Range{0, 180},
       .fits = kMeshes},
      {.flag = "--z-scale",
       .value = &o.elevation.z_scale,
       .help = "elevation rasters: heights times this; 0: 1 where the file says where it lies, else so that the relief "
               "is a seventh of its side",
       .limits = Range{-1e6, 1e6},
       .fits = kMeshes},
      {.flag = "--texture",
       .value = &o.elevation.texture,
       .help = "elevation rasters: an image draped over them",
       .fits = kMeshes,
       .is_file = true},
      {.flag = "--texture-detail",
       .value = &o.texture_detail,
       .help = "triangles, at most, that an OBJ or glTF is divided into so that its vertices carry its textures; 0: "
               "vertices as they are",
       .limits = Range{0, 1e8},
       .fits = kMeshes},
      {.flag = "--colour-by",
       .value = &o.colouring.by,
       .help =
           "colour a mesh by an array of its PLY, VTP, VTU or VTK file: ARRAY[:MIN:MAX], ARRAY a vector's length or "
           "one of its components ARRAY.x .y .z ARRAY[0]; MIN and MAX: the ends of the colour map, default: those of "
           "the array; none: the file's own colours; default: the active scalars that a VTP, VTU or VTK file marks",
       .fits = kMeshes},
      {.flag = "--colour-map",
       .value = &o.colouring.map,
       .help =
           fmt::format("colours of --colour-by: {}, each also turned round (NAME_r), or FILE.json[:NAME], a ParaView "
                       "colour map",
                       fmt::join(colour::colour_map_names(), ", ")),
       .fits = kMeshes,
       .is_file = true},
      {.flag = "--cache",
       .value = folder(o.cache_dir),
       .help = "folder of the chunk store, which meshes alone have; default: telesplat in the user's cache folder",
       .not_in_scene = "where data sets are kept"},
      {.flag = "!--no-cache", .value = &o.use_cache, .help = "keep no chunk store"},
  };
}

Table volume_table(DataOptions& o) {
  return recorded({
      {.flag = "--raw",
       .value = &o.volume.raw,
       .help = fmt::format("layout of a file that does not tell: SIZExSIZExSIZE:TYPE[:SPACING,SPACING,SPACING]"
                           "[:skip=BYTES], TYPE one of {}",
                           kRawTypes),
       .fits = kVolumesAndTheirSurfaces},
      {.flag = "--series",
       .value = &o.volume.series,
       .help = "which series of a DICOM folder: its place in the list that telesplat inspect prints, or its UID; "
               "default: the one of most slices",
       .fits = kVolumesAndTheirSurfaces},
      {.flag = "--spacing",
       .value = &o.volume.spacing,
       .help = "distances of a volume's voxels, X,Y,Z, instead of those that its files tell or lack (pictures)",
       .fits = kVolumesAndTheirSurfaces},
      {.flag = "--array",
       .value = &o.volume.array,
       .help = "which array of a VTI or VTK volume file is shown, by its name (telesplat inspect lists them); "
               "default: the one that the file marks, else its first",
       .fits = kVolumesAndTheirSurfaces},
      {.flag = "--iso",
       .value = &o.mesh.iso,
       .help = "show the surface where a volume has this value, as a mesh",
       .fits = kVolumesAndTheirSurfaces},
      {.flag = "--tf",
       .value = &o.volume.transfer,
       .help = fmt::format("transfer function: a preset ({}), a ParaView colour map (.json), or points "
                           "VALUE:#RRGGBB:OPACITY,... with values in the data's units or per cent of their range; "
                           "default: a preset that fits",
                           transfer_names()),
       .fits = kVolumes,
       .is_file = true},
      {.flag = "--lighting",
       .value = &o.volume.lit,
       .help = "on: a volume's voxels are shaded by their gradients",
       .fits = kVolumes,
       .on_off = true},
  });
}

Table series_table(VolumeOptions& o) {
  return {
      {.flag = "--series-rate",
       .value = &o.steps_per_s,
       .help = "steps a second of a numbered series; 0: it does not play; default: all steps in a second, at most "
               "12.5 a second",
       .limits = Range{0, 1000},
       .fits = kVolumes},
  };
}

}  // namespace

MeshOptions DataOptions::mesh_options() const {
  MeshOptions out = mesh;
  out.volume = volume;
  if (!out.colouring.by.empty() || out.iso) return out;
  const auto file = find_mesh_file(scene);
  out.colouring.by = file ? active_array_of(file->path) : "";
  out.colouring.by_file = !out.colouring.by.empty();
  return out;
}

Table scene_table(DataOptions& o) {
  return joined(
      recorded(joined(placement_table(o.mesh), mesh_table(o.mesh))),
      joined(grouped(joined(volume_table(o), series_table(o.volume)), "Volumes"), julia::scene_table(o.julia)));
}

Table server_table(DataOptions& o) {
  Table table{{.flag = "scene", .value = &o.scene, .help = scene_help(), .required = true},
              {.flag = "--companions",
               .value = &o.companions,
               .help = "where files may lie that the scene's files name (voxels of a detached header, materials and "
                       "textures of an OBJ, buffers and images of a glTF): folder: below the folder of the file that "
                       "names them, links included; anywhere",
               .limits = Names{"folder", "anywhere"}}};
  Table volume{
      {.flag = "--part",
       .value = &o.volume.part,
       .help = "I/N: this server has the part I (from 0) of N of the volume's slices; default: all",
       .fits = kVolumes},
      {.flag = "--volume-cache-mb",
       .value = &o.volume.cache_mb,
       .help = "memory for the steps of a series",
       .limits = Range{16, 1 << 20},
       .fits = kVolumes},
  };
  return joined(std::move(table), grouped(std::move(volume), "Volumes"));
}

Table table(DataServiceOptions& o) {
  Table own{{.flag = "--report-progress",
             .value = &o.report_progress,
             .help = "print progress lines on stdout",
             .reach = Reach::kHere}};
  return joined(joined(net::service_table(o.service, net::Ends::kBoth), std::move(own)),
                joined(server_table(o), scene_table(o)));
}

}  // namespace telesplat::data
