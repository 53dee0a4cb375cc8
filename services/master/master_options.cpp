#include "services/master/master_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "common/image/background.h"
#include "common/image/shading.h"
#include "common/scene/clip_order.h"
#include "common/volume/shear.h"
#include "common/wire/limits.h"

namespace telesplat::master {

namespace {

using scene::Kinds;
using scene::Pipeline;

constexpr const char* kWhatIsKept = "what a run keeps";
constexpr const char* kWhoComes = "who takes part, and how much";

options::Table steering_table(wire::SessionSettings& s) {
  const auto points = Kinds::of(Pipeline::kPoints);
  return {
      {.flag = "--steering",
       .value = &s.steering,
       .help = "on: before a view is sampled, the packer says which of its rays the model lacks, and only these are "
               "cast",
       .fits = points,
       .on_off = true},
      {.flag = "--view-cell",
       .value = &s.view_cell_m,
       .help = "metres of a head movement for which is sampled ahead what it would uncover; 0: nothing",
       .limits = options::Range{0.0, 10.0},
       .fits = points},
      {.flag = "--validation",
       .value = &s.validation,
       .help = "each pixel that the model shows well is sampled again once in so many updates; 0: never",
       .limits = options::Range{0.0, 4096.0},
       .fits = points},
      {.flag = "--still-rays",
       .value = &s.still_rays,
       .help = "rays a pixel everywhere while the head stands still, when it has stood long enough",
       .limits = options::Names{"1", "4", "16"},
       .fits = points}};
}

// Makes the row of --progressive: views arrive coarse first, or not.
options::Row progressive_row(Progressive& value) {
  const auto read = [&value](const std::string& text) {
    for (const auto p : {Progressive::kAuto, Progressive::kOn, Progressive::kOff})
      if (text == name_of(p)) value = p;
    return ok_status();
  };
  return {.flag = "--progressive",
          .value = options::Text{.read = read, .write = [&value] { return std::string(name_of(value)); }},
          .help = "on: a view arrives with every 4th pixel of every 4th row first; auto: of Julia sets",
          .limits = options::Names{"auto", "on", "off"},
          .fits = Kinds::of(Pipeline::kPoints)};
}

options::Table lease_table(MasterOptions& o) {
  return {{.flag = "--tile-size",
           .value = &o.schedule.tile_size,
           .help = "pixels a side of a tile",
           .limits = options::Range{16, wire::kMaxTileSide}},
          {.flag = "--max-rate",
           .value = &o.schedule.max_rate_mbit,
           .help = "Mbit/s to each viewer at most, as near as updates can be measured out; 0: what its link carries",
           .limits = options::Range{0, 1e6}},
          progressive_row(o.progressive),
          {.flag = "--octree-depth",
           .value = &o.octree_depth,
           .help = "levels of the point model's octree",
           .limits = options::Range{1, 10}},
          {.flag = "--layers",
           .value = &o.settings.layers,
           .help = "slice images that a frame of a volume has at most; more: better when the head moves",
           .limits = options::Range{1, double(volume::kMaxLayers)},
           .fits = Kinds::of(Pipeline::kSlices)}};
}

// Reads "1/32", "0.03" or "2".
std::optional<double> number_or_fraction(const std::string& text) {
  const char* const end = text.data() + text.size();
  double value = 0, divisor = 1;
  auto read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == '/') read = std::from_chars(read.ptr + 1, end, divisor);
  if (read.ec != std::errc() || read.ptr != end || !(divisor > 0)) return std::nullopt;
  return value / divisor;
}

// Makes the row of an allowed error of points: -1 is auto, 0 off.
options::Row error_row(double& value, const char* flag, double most, bool whole, const char* help) {
  options::Row row{.flag = flag, .value = {}, .help = help, .fits = Kinds::of(Pipeline::kPoints)};
  row.value = options::Text{
      .read =
          [&value, most, whole](const std::string& text) {
            if (text == "auto") return value = -1, ok_status();
            if (text == "off") return value = 0, ok_status();
            const auto number = number_or_fraction(text);
            if (!number || !(*number >= 0 && *number <= most) || (whole && *number != std::floor(*number)))
              return Status(Error{fmt::format("is not auto, off or a {}number from 0 to {}{}", whole ? "whole " : "",
                                              most, whole ? "" : ", such as 1/32")});
            value = *number;
            return ok_status();
          },
      .write = [&value] { return value < 0    ? "auto"
                                 : value == 0 ? "off"
                                              : options::number_text(value); }};
  return row;
}

options::Table error_table(wire::SessionSettings& s) {
  return {error_row(s.errors.depth, "--depth-error", 1, false,
                    "how far points may be from where they were sampled, in pixels' footprints at their depth; auto: "
                    "1/32 behind slow links, else off; what stands still becomes exact"),
          error_row(s.errors.normal, "--normal-error", 3, true,
                    "likewise normals, in codes; auto: 1 behind slow links (docs/links.md has degrees)"),
          error_row(s.errors.colour, "--colour-error", 15, true,
                    "likewise each channel of colours, of 255; auto: 1 behind slow links")};
}

// Flags for pictures, if views come as pictures.
options::Table image_table(wire::SessionSettings& s) {
  const auto points = Kinds::of(Pipeline::kPoints);
  return {
      {.flag = "--image-quality",
       .value = &s.picture_quality,
       .help = "--coupling images: JPEG quality of pictures while the head moves; from 95 on colours keep all pixels",
       .limits = options::Range{1, 100},
       .fits = points},
      {.flag = "--image-samples",
       .value = &s.picture_samples,
       .help = "--coupling images: rays a pixel while the head moves",
       .limits = options::Names{"1", "4", "16"},
       .fits = points}};
}

options::Row shading_row(wire::SessionSettings& s) {
  const options::Names names(image::kShadingNames.begin(), image::kShadingNames.end());
  const auto read = [&s, names](const std::string& text) {
    s.pictures = true;
    s.picture_shading = uint64_t(std::find(names.begin(), names.end(), text) - names.begin());
    return ok_status();
  };
  const auto write = [&s, names] { return s.pictures ? names[size_t(s.picture_shading)] : std::string(); };
  return {.flag = "--images",
          .value = options::Text{.read = read, .write = write},
          .help =
              "views are drawn at the samplers and come as pictures, with this shading: lit, head or unlit; "
              "telesplat run --coupling images asks for it",
          .limits = names,
          .fits = Kinds::of(Pipeline::kPoints),
          .reach = options::Reach::kHere};
}

options::Row background_row(wire::SessionSettings& s) {
  const auto read = [&s](const std::string& text) -> Status {
    const auto background = image::parse_background(text);
    if (!background) return background.error();
    if (background->transparent) return Error{"pictures have no alpha"};
    s.picture_background = background->colour;
    return ok_status();
  };
  return {.flag = "--image-background",
          .value = options::Text{.read = read, .write = [&s] { return fmt::format("#{:06x}", s.picture_background); }},
          .help = "--images: colour behind the data, #rrggbb or a name",
          .reach = options::Reach::kHere};
}

options::Row clip_row(MasterOptions& o) {
  return {.flag = "--clip",
          .value = &o.clip,
          .help =
              "what is cut away, in the data's own coordinates: 'plane x>=50%' or 'plane A,B,C,D' keeps one side, "
              "'box X0,Y0,Z0,X1,Y1,Z1' the inside; several are separated by \";\"",
          .limits = options::Check([](const std::string& text) {
            const auto order = scene::parse_clip(text);
            return order ? std::string() : order.error().text;
          })};
}

options::Table packing_table(wire::SessionSettings& s) {
  const auto points = Kinds::of(Pipeline::kPoints);
  const auto read = [&s](const std::string& text) {
    s.keep_redundant = text == "keep";
    return ok_status();
  };
  return {{.flag = "--packing.max_points",
           .value = &s.max_points,
           .help = "points the model holds at most; 0: no limit",
           .limits = options::Range{0.0, 1e12},
           .fits = points},
          {.flag = "--base-triangles",
           .value = &s.base_triangles,
           .help = "triangles of the coarse form of the whole mesh that each viewer shows, at most; 0: none",
           .limits = options::Range{0.0, double(wire::kMaxBaseTriangles)},
           .fits = points},
          {.flag = "--packing.obsolete_after_s",
           .value = &s.obsolete_after_s,
           .help = "forget clusters not seen for so long, at least 3 s; 0: never",
           .limits = options::Range{0.0, 1e12},
           .fits = points},
          {.flag = "--packing.redundancy",
           .value = options::Text{.read = read, .write = [&s] { return s.keep_redundant ? "keep" : "eliminate"; }},
           .help = "eliminate: pack what the model does not show yet; keep: everything, viewers draw the best patches",
           .limits = options::Names{"eliminate", "keep"},
           .fits = points}};
}

}  // namespace

options::Table session_table(MasterServiceOptions& o) {
  wire::SessionSettings& s = o.master.settings;
  return options::joined(options::joined(options::joined(lease_table(o.master), steering_table(s)),
                                         options::joined(packing_table(s), error_table(s))),
                         options::joined(image_table(s), {clip_row(o.master)}));
}

options::Table limit_table(MasterServiceOptions& o) {
  Limits& l = o.master.limits;
  return {{.flag = "--max-sampling-pixels",
           .value = &l.max_sampling_pixels,
           .help = "pixels of a view at most; of one that has more, every second, third, ... of each row and column is "
                   "sampled",
           .limits = options::Range{1, 1 << 28}},
          {.flag = "--max-peers",
           .value = &l.max_peers,
           .help = "processes that take part at a time; further ones are refused",
           .limits = options::Range{1, 4096},
           .not_in_scene = kWhoComes},
          {.flag = "--max-messages",
           .value = &l.max_messages,
           .help = "messages of one process a second, the packer's left out; what is beyond is dropped and counted; of "
                   "telesplat run also to packer and data servers, which take 20000 unless it is given",
           .limits = options::Range{10.0, 1e6},
           .not_in_scene = kWhoComes}};
}

options::Table record_table(MasterServiceOptions& o) {
  return {{.flag = "--table-limit-mb",
           .value = &o.table_limit_mb,
           .help = "MB that each table of the record has at most (frames.csv, tiles.csv, ...); what is beyond is "
                   "counted; 0: no limit",
           .limits = options::Range{0.0, 1e9},
           .not_in_scene = kWhatIsKept},
          {.flag = "--trace-limit-mb",
           .value = &o.trace_limit_mb,
           .help = "MB that the record's trace.json has at most; 0: no limit",
           .limits = options::Range{0.0, 1e9},
           .not_in_scene = kWhatIsKept},
          {.flag = "--label",
           .value = &o.label,
           .help = "name of the run in its summary and in reports",
           .not_in_scene = kWhatIsKept}};
}

options::Row metrics_port_row(MasterServiceOptions& o) {
  return {.flag = "--metrics-port",
          .value = &o.metrics_port,
          .help = "port at which http://127.0.0.1:PORT/metrics has the session's figures for Prometheus; 0: none",
          .limits = options::Range{0, 65535}};
}

options::Table table(MasterServiceOptions& o) {
  const options::Table own{
      {.flag = "--out", .value = &o.out, .help = "folder for the run's record", .reach = options::Reach::kHere},
      {.flag = "--overwrite",
       .value = &o.overwrite,
       .help = "the folder of --out may hold a record already: its files are replaced, others stay",
       .reach = options::Reach::kHere},
      {.flag = "--continue",
       .value = &o.goes_on,
       .help = "go on with the record that a master before left in the folder of --out, if there is one",
       .reach = options::Reach::kHere},
      {.flag = "--started-by",
       .value = &o.started_by,
       .help = "what telesplat ctl list shows: hand, or the command of telesplat that started it",
       .limits = options::Names{"hand", "run", "view", "bench"},
       .reach = options::Reach::kHere},
      metrics_port_row(o),
      {.flag = "--metrics-address",
       .value = &o.metrics_address,
       .help = "address of --metrics-port; one that is not loopback needs --insecure",
       .reach = options::Reach::kHere},
      {.flag = "--animate",
       .value = &o.animate,
       .help = "change a Julia set's parameters with time: c.y=-0.4:0.4:10s, or c.y=@0s:-0.4@5s:0.4@10s:-0.4; several "
               "are separated by \";\"",
       .reach = options::Reach::kHere},
      shading_row(o.master.settings),
      background_row(o.master.settings)};
  return options::joined(options::joined(net::service_table(o.service, net::Ends::kBinds), own),
                         options::joined(options::joined(record_table(o), limit_table(o)), session_table(o)));
}

namespace {

const scene::Policy& policy(std::optional<scene::Kind> kind) {
  return scene::policy_of(kind.value_or(scene::Kind::kMesh));
}

}  // namespace

const char* name_of(Progressive progressive) {
  return progressive == Progressive::kAuto ? "auto" : progressive == Progressive::kOn ? "on" : "off";
}

bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind) {
  if (options.settings.pictures) return false;
  return options.progressive == Progressive::kAuto ? policy(kind).progressive : options.progressive == Progressive::kOn;
}

wire::SessionSettings settings(const MasterOptions& options, std::optional<scene::Kind> kind) {
  wire::SessionSettings out = options.settings;
  const bool points = scene::pipeline_of(kind.value_or(scene::Kind::kMesh)) == scene::Pipeline::kPoints;
  out.steering = out.steering && points && !out.pictures && !out.keep_redundant;
  out.max_rate_mbit = options.schedule.max_rate_mbit;
  out.max_sampling_pixels = options.limits.max_sampling_pixels;
  out.least_sampling = policy(kind).least_sampling;
  return out;
}

}  // namespace telesplat::master
