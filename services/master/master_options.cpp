#include "services/master/master_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>

#include <fmt/format.h>

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

// A row whose value is one of the names that name_of() has for `values`.
template <class Enum, size_t n>
options::Row named(options::Row row, Enum& value, const Enum (&values)[n]) {
  options::Names names;
  for (const Enum v : values) names.emplace_back(name_of(v));
  row.limits = names;
  row.value = options::Text{
      .read =
          [&value, names, all = std::vector<Enum>(std::begin(values), std::end(values))](const std::string& text) {
            const auto found = std::find(names.begin(), names.end(), text);
            if (found == names.end()) return Status(Error{fmt::format("is not one of {}", fmt::join(names, ", "))});
            value = all[size_t(found - names.begin())];
            return ok_status();
          },
      .write = [&value] { return std::string(name_of(value)); }};
  return row;
}

// A setting of the session, which has `usual` unless it is given.
options::Row setting(MasterOptions& o, const std::string& name, double usual, const char* help) {
  return {.flag = "--" + name,
          .value = &o.settings.try_emplace(name, usual).first->second,
          .help = help,
          .limits = options::Range{0.0, 1e12},
          .fits = Kinds::of(Pipeline::kPoints)};
}

// A setting that the kind of scene decides unless it is given: then it is not among the settings.
options::Row setting_by_kind(MasterOptions& o, const std::string& name, const char* help, const char* usual) {
  options::Row row{.flag = "--" + name, .value = {}, .help = help, .limits = options::Range{0.0, 1e12}};
  row.value = options::Text{.read =
                                [&o, name](const std::string& text) {
                                  double value = 0;
                                  const auto [stop, error] =
                                      std::from_chars(text.data(), text.data() + text.size(), value);
                                  if (error != std::errc() || stop != text.data() + text.size())
                                    return Status(Error{"is not a number"});
                                  o.settings[name] = value;
                                  return ok_status();
                                },
                            .write =
                                [&o, name] {
                                  const auto found = o.settings.find(name);
                                  return found == o.settings.end() ? std::string() : fmt::format("{}", found->second);
                                }};
  row.fits = Kinds::of(Pipeline::kPoints);
  row.default_text = usual;
  return row;
}

// One of a few whole numbers.
options::Row one_of_few(auto& value, const char* flag, const options::Names& values, const char* help) {
  options::Row row{.flag = flag, .value = {}, .help = help, .limits = values};
  row.value = options::Text{.read =
                                [&value, values](const std::string& text) {
                                  if (std::find(values.begin(), values.end(), text) == values.end())
                                    return Status(Error{fmt::format("is not one of {}", fmt::join(values, ", "))});
                                  value = std::stoi(text);
                                  return ok_status();
                                },
                            .write = [&value] { return fmt::format("{}", value); }};
  row.fits = Kinds::of(Pipeline::kPoints);
  return row;
}

options::Table steering_table(MasterOptions& o) {
  const auto points = Kinds::of(Pipeline::kPoints);
  const options::Names rays{"1", "4", "16"};
  const auto setting_value = [&o](const char* name, double usual) -> double& {
    return o.settings.try_emplace(name, usual).first->second;
  };
  return {named({.flag = "--steering",
                 .value = {},
                 .help = "on: before a view is sampled, the packer says which of its rays the model lacks, and only "
                         "these are cast; auto: where redundancy is eliminated",
                 .fits = points},
                o.steering, {Steering::kAuto, Steering::kOn, Steering::kOff}),
          {.flag = "--view-cell,--sampling.view_cell_m",
           .value = &o.settings.try_emplace("sampling.view_cell_m", 0.2).first->second,
           .help = "metres of a head movement for which is sampled ahead what it would uncover; 0: nothing",
           .limits = options::Range{0.0, 10.0},
           .fits = points},
          {.flag = "--validation,--sampling.validation",
           .value = &o.settings.try_emplace("sampling.validation", 32).first->second,
           .help = "each pixel that the model shows well is sampled again once in so many updates; 0: never",
           .limits = options::Range{0.0, 4096.0},
           .fits = points},
          one_of_few(setting_value("sampling.still_rays", 16), "--still-rays,--sampling.still_rays", rays,
                     "rays a pixel everywhere while the head stands still, when it has stood long enough")};
}

options::Table lease_table(MasterOptions& o) {
  return {{.flag = "--tile-size",
           .value = &o.schedule.tile_size,
           .help = "pixels a side of a tile",
           .limits = options::Range{16, wire::kMaxTileSide}},
          {.flag = "--frames-in-flight",
           .value = &o.schedule.frames_in_flight,
           .help = "sampling frames begun and not complete",
           .limits = options::Range{1, 16}},
          {.flag = "--lease-timeout",
           .value = &o.schedule.lease_timeout_s,
           .help = "seconds before a lease goes to another sampler",
           .limits = options::Range{0.05, 3600}},
          {.flag = "--longest-fetch",
           .value = &o.schedule.longest_fetch_s,
           .help = "seconds that a sampler may have a lease that it asks to be extended, while it fetches data",
           .limits = options::Range{1, 3600}},
          {.flag = "--silent-after",
           .value = &o.silent_after_s,
           .help = "seconds after which a process that says nothing is taken for dead",
           .limits = options::Range{2.0, 600.0}},
          {.flag = "--max-rate",
           .value = &o.schedule.max_rate_mbit,
           .help = "Mbit/s to each viewer at most, as near as updates can be measured out; 0: what its link carries",
           .limits = options::Range{0, 1e6}},
          {.flag = "--lease-target",
           .value = &o.schedule.lease_target_s,
           .help = "seconds that a lease of a Julia set's rows should take",
           .limits = options::Range{1e-4, 10},
           .fits = Kinds::of(Pipeline::kPoints)},
          named({.flag = "--progressive",
                 .value = {},
                 .help = "on: a view arrives with every 4th pixel of every 4th row first; auto: of Julia sets",
                 .fits = Kinds::of(Pipeline::kPoints)},
                o.progressive, {Progressive::kAuto, Progressive::kOn, Progressive::kOff}),
          {.flag = "--octree-depth",
           .value = &o.octree_depth,
           .help = "levels of the point model's octree; 0: 5",
           .limits = options::Range{0, 10}},
          {.flag = "--layers,--volume.layers",
           .value = &o.settings.try_emplace("volume.layers", 16).first->second,
           .help = "slice images that a frame of a volume has at most; more: better when the head moves",
           .limits = options::Range{1, double(volume::kMaxLayers)},
           .fits = Kinds::of(Pipeline::kSlices)}};
}

// "1/32", "0.03" or "2".
std::optional<double> number_or_fraction(const std::string& text) {
  const char* const end = text.data() + text.size();
  double value = 0, divisor = 1;
  auto read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == '/') read = std::from_chars(read.ptr + 1, end, divisor);
  if (read.ec != std::errc() || read.ptr != end || !(divisor > 0)) return std::nullopt;
  return value / divisor;
}

// How far from what was sampled points may be: -1 is auto, 0 off.
options::Row error_row(MasterOptions& o, const std::string& flag, const std::string& name, double most, bool whole,
                       const char* help) {
  double& value = o.settings.try_emplace(name, -1).first->second;
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

options::Table error_table(MasterOptions& o) {
  return {error_row(o, "--depth-error", "packing.depth_error", 1, false,
                    "how far points may be from where they were sampled, in pixels' footprints at their depth; auto: "
                    "1/32 behind slow links, else off; what stands still becomes exact"),
          error_row(o, "--normal-error", "packing.normal_error", 3, true,
                    "likewise normals, in codes; auto: 1 behind slow links (docs/links.md has degrees)"),
          error_row(o, "--colour-error", "packing.colour_error", 15, true,
                    "likewise each channel of colours, of 255; auto: 1 behind slow links")};
}

// The numbers are what the wire and session.toml say: -1 auto, 0 eliminate, 1 keep.
options::Row redundancy_row(MasterOptions& o) {
  options::Row row = named(
      {.flag = "--packing.redundancy,--packing.keep_redundant",
       .value = {},
       .help = "eliminate: pack what the model does not show yet; keep: everything, viewers draw the best patches; "
               "auto: eliminate",
       .fits = Kinds::of(Pipeline::kPoints)},
      o.redundancy, {Redundancy::kAuto, Redundancy::kEliminate, Redundancy::kKeep});
  auto& value = std::get<options::Text>(row.value);
  value.read = [read = value.read](const std::string& text) {
    return read(text == "-1" ? "auto" : text == "0" ? "eliminate" : text == "1" ? "keep" : text);
  };
  row.limits = options::Names{"auto", "eliminate", "keep", "-1", "0", "1"};
  return row;
}

// What pictures are like, where views come as pictures.
options::Table image_table(MasterOptions& o) {
  const auto points = Kinds::of(Pipeline::kPoints);
  return {
      {.flag = "--image-quality",
       .value = &o.images.quality,
       .help = "--coupling images: JPEG quality of pictures while the head moves; from 95 on colours keep all pixels",
       .limits = options::Range{1, 100},
       .fits = points},
      one_of_few(o.images.samples, "--image-samples", {"1", "4", "16"},
                 "--coupling images: rays a pixel while the head moves")};
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

options::Table packing_table(MasterOptions& o) {
  return {setting_by_kind(o, "packing.max_points", "points the model holds at most", "20e6"),
          setting(o, "packing.obsolete_after_s", 0, "forget clusters not seen for so long; 0: never"),
          setting(o, "packing.epsilon", 0.004, "redundancy threshold, relative to depth"),
          setting(o, "packing.age_weight", 1,
                  "patches that are kept: how fast one not drawn comes to be forgotten, per second"),
          setting(o, "packing.rate_weight", 4,
                  "patches that are kept: how much coarser ones come before finer ones, per halving"),
          setting(o, "packing.patches_per_cluster", 6, "patches that are kept of a cluster at most; 0: no limit"),
          redundancy_row(o)};
}

}  // namespace

options::Table session_table(MasterServiceOptions& o) {
  return options::joined(options::joined(options::joined(lease_table(o.master), steering_table(o.master)),
                                         options::joined(packing_table(o.master), error_table(o.master))),
                         options::joined(image_table(o.master), {clip_row(o.master)}));
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
      {.flag = "--images",
       .value = &o.master.images.shading,
       .help = "views are drawn at the samplers and come as pictures, with this shading: lit, head or unlit; telesplat "
               "run --coupling images asks for it",
       .limits = options::Names(image::kShadingNames.begin(), image::kShadingNames.end()),
       .fits = Kinds::of(Pipeline::kPoints),
       .reach = options::Reach::kHere},
      {.flag = "--image-background",
       .value = &o.master.images.background,
       .help = "--images: colour behind the data, #rrggbb or a name",
       .limits = options::Check([](const std::string& text) {
         const auto background = image::parse_background(text);
         return !background ? background.error().text : background->transparent ? "pictures have no alpha" : "";
       }),
       .reach = options::Reach::kHere}};
  return options::joined(options::joined(net::service_table(o.service, net::Ends::kBinds), own),
                         options::joined(options::joined(record_table(o), limit_table(o)), session_table(o)));
}

}  // namespace telesplat::master
