// Messages of a session, between every process (DEALER) and the master (ROUTER): members, scene, measurements, end.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/wire/limits.h"
#include "common/wire/moments.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

/// First message of every process. It is repeated when the master asks "who_are_you" or a bound endpoint changes.
struct Hello {
  static constexpr std::string_view kName = "hello";
  std::string role;  ///< "data", "sampler", "packer", "viewer", "ctl"
  std::string name;  ///< for people: "sampler-1"
  InstanceId instance;
  uint64_t pid = 0;
  double sent_s = 0;  ///< sender's own clock: for the clock offset
  /// Bound sockets that others connect to. data: "chunks" or "voxels"; packer: "tiles", "patches", "state".
  std::map<std::string, std::string> endpoints;
  /// data: "scene", "kind", "triangles"; sampler: "sampler"; viewer: "renderer"; docs/protocol.md has all.
  std::map<std::string, std::string> facts;
  /// data: parameters of the scene, as it begins (julia/parameters.h); empty otherwise.
  std::map<std::string, double> parameters;
  geometry::Box box_room;  ///< data: the data set's box; empty otherwise
  template <class F> static void fields(F& f, auto& m) {
    f("role", m.role); f("name", m.name); f("instance", m.instance); f("pid", m.pid); f("sent_s", m.sent_s);
    f("endpoints", m.endpoints); f("facts", m.facts, kMaxFact); f("parameters", m.parameters);
    f("box_room", m.box_room);
  }
};

/// Coupling that `telesplat ctl coupling` orders a viewer to use.
enum class CouplingOrder : uint8_t {
  kOwn,  ///< the coupling that the viewer began with
  kAsync,
  kSync,
  kLoose
};
inline constexpr uint64_t kCouplingOrders = 4;

/// Largest errors of points as compared with their samples. Negative: chosen by the link; 0: exact.
struct PointErrors {
  double depth = -1;  ///< in pixels' footprints at their depth
  double normal = -1;  ///< codes of the octahedral map, each coordinate
  double colour = -1;  ///< each channel, of 255
  bool operator==(const PointErrors&) const = default;
};

/// Settings of a session. All defaults stand here; serial.cpp has the limits.
struct SessionSettings {
  // The point model, and how it travels.
  bool keep_redundant = false;  ///< also packs points that the model shows already (T7.3)
  uint64_t max_points = 20'000'000;  ///< least recently drawn clusters are forgotten above it; 0: no limit
  double obsolete_after_s = 0;  ///< clusters that nothing drew for longer are forgotten (T4.3.3); 0: never
  uint64_t base_triangles = 500'000;  ///< most triangles of the mesh's coarse form that each viewer shows; 0: none
  PointErrors errors;
  double max_rate_mbit = 0;  ///< wished rate to each viewer; 0: as much as its link carries
  // Sampling.
  bool steering = true;  ///< the packer plans which rays of a view are cast
  double view_cell_m = 0.2;  ///< extra rays let the head move this far before it sees unknown places; 0: none
  uint64_t validation = 32;  ///< every good pixel is cast once in this many plans of a view; 0: never
  uint64_t still_rays = 16;  ///< rays a pixel everywhere while the head stands still: 1, 4 or 16
  uint64_t max_sampling_pixels = 1u << 24;  ///< pixels of a view; larger views are sampled coarser
  uint64_t layers = 16;  ///< slice images that a frame of a volume has at most
  // Viewers.
  double least_sampling = 0.5;  ///< sampled pixels a displayed pixel, on each axis, at least
  CouplingOrder coupling = CouplingOrder::kOwn;
  uint64_t buffers = 3;  ///< buffers of loose coupling
  // Views that come as pictures.
  bool pictures = false;
  uint64_t picture_quality = 80;  ///< quality of JPEG, 1 to 100
  uint64_t picture_samples = 1;  ///< rays a pixel: 1, 4 or 16
  uint64_t picture_shading = 0;  ///< index in image::kShadingNames
  uint64_t picture_background = 0x141820;  ///< 0xRRGGBB
  bool operator==(const SessionSettings&) const = default;
  template <class F> static void fields(F& f, auto& m) {
    f("keep_redundant", m.keep_redundant); f("max_points", m.max_points);
    f("base_triangles", m.base_triangles);
    f("obsolete_after_s", m.obsolete_after_s); f("depth_error", m.errors.depth);
    f("normal_error", m.errors.normal); f("colour_error", m.errors.colour); f("max_rate_mbit", m.max_rate_mbit);
    f("steering", m.steering); f("view_cell_m", m.view_cell_m); f("validation", m.validation);
    f("still_rays", m.still_rays); f("max_sampling_pixels", m.max_sampling_pixels); f("layers", m.layers);
    f("least_sampling", m.least_sampling); f("coupling", m.coupling, kCouplingOrders); f("buffers", m.buffers);
    f("pictures", m.pictures); f("picture_quality", m.picture_quality); f("picture_samples", m.picture_samples);
    f("picture_shading", m.picture_shading); f("picture_background", m.picture_background);
  }
};

/// All settings as numbers by their fields' names, for records.
inline std::map<std::string, double> numbers_of(const SessionSettings& settings) {
  std::map<std::string, double> out;
  auto add = [&](const char* name, const auto& value, uint64_t = 0) { out[name] = static_cast<double>(value); };
  SessionSettings::fields(add, settings);
  return out;
}

/// The session as the master knows it; sent in answer to hello and again to everyone whenever it changes.
struct Welcome {
  static constexpr std::string_view kName = "welcome";
  InstanceId master;
  double hello_sent_s = 0;  ///< Hello::sent_s, echoed; 0 in an unasked welcome
  double master_s = 0;  ///< master's clock when sent
  std::string clock;  ///< clock_id() of that clock
  EpochId epoch;
  uint64_t octree_depth = 0;
  geometry::Box box_room;  ///< empty until a data server said hello
  std::map<std::string, std::string> endpoints;  ///< as in the hellos, once they are known
  std::map<std::string, std::string> facts;  ///< "scene", "kind", "triangles"
  std::map<std::string, double> parameters;  ///< parameters of the scene in this epoch
  SessionSettings settings;
  std::vector<uint32_t> lease_key;  ///< sent to the packer alone: kLeaseKeyWords numbers (lease_seal.h)
  template <class F> static void fields(F& f, auto& m) {
    f("master", m.master); f("hello_sent_s", m.hello_sent_s); f("master_s", m.master_s);
    f("clock", m.clock); f("epoch", m.epoch);
    f("octree_depth", m.octree_depth); f("box_room", m.box_room); f("endpoints", m.endpoints);
    f("facts", m.facts, kMaxFact); f("parameters", m.parameters); f("settings", m.settings);
    f("lease_key", m.lease_key, kLeaseKeyWords);
  }
};

/// Master to a peer it does not know (it was restarted): say hello again.
struct WhoAreYou {
  static constexpr std::string_view kName = "who_are_you";
  InstanceId master;
  template <class F> static void fields(F& f, auto& m) { f("master", m.master); }
};

/// Every process -> master, and its answer: the time of the master's clock (common/net/master_link.h).
struct ClockRequest {
  static constexpr std::string_view kName = "clock_request";
  double sent_s = 0;  ///< sender's own clock
  template <class F> static void fields(F& f, auto& m) { f("sent_s", m.sent_s); }
};
struct ClockReply {
  static constexpr std::string_view kName = "clock_reply";
  InstanceId master;
  double sent_s = 0;  ///< ClockRequest::sent_s
  double received_s = 0;  ///< master's clock when it took the request
  double replied_s = 0;  ///< master's clock when it answered
  std::string clock;  ///< clock_id() of that clock
  template <class F> static void fields(F& f, auto& m) {
    f("master", m.master); f("sent_s", m.sent_s); f("received_s", m.received_s); f("replied_s", m.replied_s);
    f("clock", m.clock);
  }
};

/// Every process -> master, once a second: it lives, and its counters ("rss_mb", "messages_rejected", "points", ...).
struct StatusReport {
  static constexpr std::string_view kName = "status";
  InstanceId instance;
  std::map<std::string, double> values;
  template <class F> static void fields(F& f, auto& m) { f("instance", m.instance); f("values", m.values); }
};

/// Every process -> master: rows of a metrics table ("frames", "updates", "spans"; docs/metrics.md).
struct MetricRows {
  static constexpr std::string_view kName = "metric_rows";
  static constexpr bool kBulk = true;
  InstanceId instance;
  std::string table;
  std::vector<std::string> columns;  ///< for "spans": the span names that column "name" indexes
  std::vector<double> values;  ///< rows x columns, row-major (as bin, little-endian f64)
  template <class F> static void fields(F& f, auto& m) {
    f("instance", m.instance); f("table", m.table); f("columns", m.columns); f("values", m.values);
  }
};

/// telesplat ctl -> master, and its answer.
struct Control {
  static constexpr std::string_view kName = "control";
  /// "status", "stop", "epoch", "set" (arguments: parameter -> value), "animate" (argument "timeline": as
  /// julia::parse_timeline takes it, or "off"), "tf" (argument "transfer": a preset's name or points, as
  /// volume::parse_transfer takes them), "colour" (arguments "array": as scene::parse_colour_by takes it, "map": as
  /// colour::from_text takes it), "clip" (argument "clip": as scene::parse_clip takes it), "play" (arguments "how":
  /// play, pause or step; "steps"), orders that a viewer or a data server answers ("pick", "where", "go", "overlay",
  /// "measure", "probe"; argument "viewer": its name), "coupling" (arguments "coupling": async, sync or loose;
  /// "buffers": 1 to kMaxBuffers, for loose; "viewer": its name).
  std::string command;
  std::map<std::string, std::string> arguments;
  template <class F> static void fields(F& f, auto& m) {
    f("command", m.command); f("arguments", m.arguments, kMaxFact);
  }
};
struct ControlReply {
  static constexpr std::string_view kName = "control_reply";
  bool ok = false;
  std::string text;  ///< JSON for "status", else one line; at most kMaxControlBytes
  template <class F> static void fields(F& f, auto& m) { f("ok", m.ok); f("text", m.text, kMaxControlBytes); }
};

/// Master -> viewer or data server: a user asks for a fact that only this process knows, or wishes that it does
/// something (docs/protocol.md has the orders). OrderAnswer is its answer, which the master passes on.
struct Order {
  static constexpr std::string_view kName = "order";
  uint64_t number = 0;  ///< the master's number for it; the answer repeats it
  std::string command;  ///< viewer: "pick", "where", "go", "measure", "overlay"; data: "probe"
  std::map<std::string, std::string> arguments;
  template <class F> static void fields(F& f, auto& m) {
    f("number", m.number); f("command", m.command); f("arguments", m.arguments, kMaxFact);
  }
};
struct OrderAnswer {
  static constexpr std::string_view kName = "order_answer";
  InstanceId instance;  ///< process that answers
  uint64_t number = 0;
  bool ok = false;
  std::string text;  ///< JSON, or the reason of a refusal; at most kMaxControlBytes
  template <class F> static void fields(F& f, auto& m) {
    f("instance", m.instance); f("number", m.number); f("ok", m.ok); f("text", m.text, kMaxControlBytes);
  }
};

/// First words of the reason of a shutdown that answers a hello: the process may say hello again as another instance.
inline constexpr std::string_view kInstanceTaken = "its instance is another's";

/// Master -> everyone: finish, flush metrics, say goodbye, exit 0. A process that leaves by itself sends Goodbye too.
struct Shutdown {
  static constexpr std::string_view kName = "shutdown";
  std::string reason;
  template <class F> static void fields(F& f, auto& m) { f("reason", m.reason); }
};
struct Goodbye {
  static constexpr std::string_view kName = "goodbye";
  InstanceId instance;
  template <class F> static void fields(F& f, auto& m) { f("instance", m.instance); }
};

// clang-format on

}  // namespace telesplat::wire
