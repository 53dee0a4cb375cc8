// `telesplat-lab cache`: what a point model costs after minutes of walking, without waiting for real time. Each view
// of a walk is sampled by rays, packed, coded, decoded and inserted by the code that packer and viewer run, one view
// after the other in this process.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "client/viewer/points/model_cache.h"
#include "client/viewer/viewer_service.h"
#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/image/measures/quality.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "common/points/compaction.h"
#include "common/splat/cpu_splatter.h"
#include "services/packer/points/packer_core.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/lab/commands.h"
#include "tools/lab/walk.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::lab {
namespace {

constexpr int kTile = 256;          // as the master cuts frames
constexpr double kDrawEvery_s = 1;  // of the walk
constexpr double kCompareEvery_s = 5;

struct CacheOptions {
  data::DataOptions data;            ///< a mesh or its like: what rays sample
  std::string trajectory = "orbit";  ///< or CSV files with commas between, walked one after the other, round and round
  double minutes = 5;                ///< of the walk
  double views_per_s = 4;            ///< sampled, of the walk's seconds
  double latency_s = 0.2;            ///< the display is as far ahead of the views
  std::string size = "1280x800";     ///< of the display
  std::string sampling_size;         ///< empty: the display's
  double fov_deg = 90;
  int octree_depth = 0;  ///< 0: as the master chooses for meshes
  int threads = 0;       ///< to sample and to draw with; 0: all cores
  std::string splat = "disc";
  double splat_scale = 0;  ///< 0: what suits the kernel
  double nearest = -1;     ///< packer::Config::nearest_sample; below 0: as sessions have it
  std::string out;         ///< folder for cache.csv and pictures; empty: none
};

// The same points in a model of one mosaic a cluster, as if they had all come at once.
points::PointModel made_at_once(const points::PointModel& model) {
  points::PointModel out(model.config());
  points::PreparedPatch all{Sequence{1}, {}};
  for (const auto& [key, cluster] : model.clusters()) {
    std::vector<const points::Mosaic*> parts;
    for (const points::Mosaic& m : cluster->mosaics) parts.push_back(&m);
    all.mosaics.emplace_back(key, points::merge_mosaics(parts, Sequence{1}));
  }
  std::sort(all.mosaics.begin(), all.mosaics.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  out.insert(std::move(all));
  return out;
}

struct Minute {
  std::vector<double> clusters, items, points, select_ms, splat_ms, psnr_db, holes;
  double at_once_items = 0, at_once_ms = 0;
  double cached = 0, bytes_a_point = 0, sent_points = 0, sent_mb = 0, pack_ms = 0, insert_ms = 0;
  uint64_t views = 0;
};

class CacheBench {
 public:
  CacheBench(const CacheOptions& o, launcher::DirectScene& scene, Walk walk, std::pair<int, int> display,
             std::pair<int, int> sampling)
      : o_(o),
        scene_(scene),
        walk_(std::move(walk)),
        display_(display),
        sampling_(sampling),
        config_{scene.box_room(), o.octree_depth > 0 ? o.octree_depth : points::ModelConfig{}.depth, true},
        packer_(packer_config(o, config_), EpochId{1}),
        splatter_(o.threads) {
    cache_.begin_replica(config_, EpochId{1});
    frame_.colour.resize(size_t(display.first) * display.second);
    frame_.depth_m.resize(frame_.colour.size());
    frame_.width = display.first, frame_.height = display.second;
  }

  Status run() {
    print_header();
    const double end_s = o_.minutes * 60, step_s = 1 / o_.views_per_s;
    double drawn_s = 0, compared_s = 0;
    Minute minute;
    int number = 1;
    for (double t = 0; t < end_s && !net::stop_requested(); t += step_s) {
      progress_.show(fmt::format("walked {:.0f} of {:.0f} s", t, end_s));
      if (const Status s = update(t, minute); !s) return s;
      if (t - drawn_s >= kDrawEvery_s) {
        drawn_s = t;
        if (const Status s = draw(t + o_.latency_s, t - compared_s >= kCompareEvery_s, minute); !s) return s;
        if (t - compared_s >= kCompareEvery_s) compared_s = t;
      }
      if (t + step_s >= std::min(60.0 * number, end_s)) {
        progress_.close();
        if (!minute.items.empty()) draw_at_once(t + o_.latency_s, minute);
        print(number++, minute);
        minute = {};
      }
    }
    progress_.close();
    print_late_joiner();
    return ok_status();
  }

 private:
  void draw_at_once(double t, Minute& minute) {
    const geometry::Camera camera = geometry::make_camera(walk_.at(t), o_.fov_deg, display_.first, display_.second);
    const points::PointModel model = made_at_once(packer_.model());
    splat::DrawList list;
    std::vector<double> select_ms, splat_ms;
    for (int pass = 0; pass < 5; ++pass) {
      const double begin = monotonic_s();
      splat::select_view(model, camera, selection(), list);
      const double selected = monotonic_s();
      splatter_.render(list, camera, render_options(), image::Shading(image::ShadingParameters{}, camera),
                       {camera.width, camera.height, frame_.colour.data(), frame_.depth_m.data()});
      select_ms.push_back((selected - begin) * 1e3);
      splat_ms.push_back((monotonic_s() - selected) * 1e3);
    }
    minute.at_once_items = double(list.items.size());
    minute.at_once_ms = median(select_ms) + median(splat_ms);
  }

  // What a viewer that joins now is sent, beside the patches that have points in the model.
  void print_late_joiner() const {
    uint64_t patches = 0, others = 0, points = 0;
    for (const auto& event : packer_.events_since(Sequence{})) {
      if (event.kind == packer::Event::Kind::kPatch)
        patches += event.blob->size(), points += event.kept;
      else
        others += 4 * (event.clusters.size() + event.frames.size());
    }
    std::printf(
        "a viewer that joins now is sent %.2f MB, %.3f times the patches of the live points; %.2f bytes a point\n",
        double(patches + others) * 1e-6, patches ? double(patches + others) / double(patches) : 0.0,
        points ? double(patches + others) / double(packer_.model().points()) : 0.0);
  }

  splat::SelectionOptions selection() const {
    splat::SelectionOptions out;
    out.scale = o_.splat_scale > 0 ? float(o_.splat_scale) : splat::suitable_scale(render_options().kernel);
    return out;
  }
  splat::RenderOptions render_options() const { return {*splat::kernel_named(o_.splat), {}}; }

  static packer::Config packer_config(const CacheOptions& o, const points::ModelConfig& model) {
    packer::Config out{.model = model, .threads = o.threads};
    if (o.nearest >= 0) out.nearest_sample = float(o.nearest);
    return out;
  }

  Status update(double t, Minute& minute) {
    const geometry::Camera camera = geometry::make_camera(walk_.at(t), o_.fov_deg, sampling_.first, sampling_.second);
    const auto image = scene_.sample(camera, EpochId{1});
    if (!image) return image.error();
    ++frames_;
    const int columns = (camera.width + kTile - 1) / kTile, rows = (camera.height + kTile - 1) / kTile;
    for (int i = 0; i < columns * rows; ++i) {
      const int x = i % columns * kTile, y = i / columns * kTile;
      const geometry::Rect rect{x, y, std::min(kTile, camera.width - x), std::min(kTile, camera.height - y)};
      packer::SampledTile tile;
      tile.frame = FrameId{frames_};
      tile.epoch = EpochId{1};
      tile.tile = uint32_t(i), tile.tiles_in_frame = uint32_t(columns * rows);
      tile.camera = camera, tile.rect = rect;
      tile.image = cut(*image, rect);
      const double begin = monotonic_s();
      const auto event = packer_.submit(std::move(tile), t);
      if (!event) return event.error();
      const double packed = monotonic_s();
      minute.pack_ms += (packed - begin) * 1e3;
      if (!*event || !(*event)->is_told()) continue;
      auto decoded = codec::decode(*(*event)->blob);
      if (!decoded) return decoded.error();
      const packer::Event& patch = **event;
      cache_.insert(points::prepare_patch(config_, patch.sequence, patch.camera, patch.rect, *decoded, patch.tag()),
                    EpochId{1});
      minute.insert_ms += (monotonic_s() - packed) * 1e3;
      minute.sent_points += double((*event)->kept);
      minute.sent_mb += double((*event)->blob->size()) * 1e-6;
    }
    ++minute.views;
    cache_.summarise(~size_t{0});
    cache_.free_dropped();
    return ok_status();
  }

  Status draw(double t, bool compare, Minute& minute) {
    const geometry::Camera camera = geometry::make_camera(walk_.at(t), o_.fov_deg, display_.first, display_.second);
    const image::ShadingParameters lit;
    // The second time is what counts: a display draws all the time.
    double begin = 0, selected = 0, drawn = 0;
    for (int pass = 0; pass < 2; ++pass) {
      begin = monotonic_s();
      cache_.select(camera, selection(), list_);
      selected = monotonic_s();
      splatter_.render(list_, camera, render_options(), image::Shading(lit, camera),
                       {camera.width, camera.height, frame_.colour.data(), frame_.depth_m.data()});
      drawn = monotonic_s();
      cache_.end_frame();
    }
    minute.items.push_back(double(list_.items.size()));
    minute.clusters.push_back(double(list_.clusters_seen.size()));
    minute.points.push_back(double(list_.points));
    minute.select_ms.push_back((selected - begin) * 1e3);
    minute.splat_ms.push_back((drawn - selected) * 1e3);
    const auto figures = cache_.figures();
    minute.cached = double(figures.points);
    minute.bytes_a_point = figures.points ? double(figures.bytes) / double(figures.points) : 0;
    if (!compare) return ok_status();
    const auto reference = scene_.draw(camera, lit, EpochId{1});
    if (!reference) return reference.error();
    const auto quality = image::compare(*reference, frame_);
    if (quality.object_pixels == 0) return ok_status();
    minute.psnr_db.push_back(quality.psnr_db);
    minute.holes.push_back(100 * quality.hole_fraction);
    if (o_.out.empty()) return ok_status();
    if (const Status s = image::write_png(fmt::format("{}/{:04.0f}-points.png", o_.out, t), frame_); !s) return s;
    return image::write_png(fmt::format("{}/{:04.0f}-direct.png", o_.out, t), *reference);
  }

  static double median(std::vector<double> v) { return metrics::distribution(std::move(v)).median; }

  void print_header() const {
    std::printf("%6s %8s %9s %9s %9s %8s %9s %9s %8s %8s %9s %9s %9s %9s %12s %10s\n", "minute", "clusters", "items",
                "drawn", "cached", "B/point", "select ms", "splat ms", "PSNR dB", "holes %", "sent k/s", "sent MB/s",
                "pack ms", "insert ms", "once: items", "once: ms");
  }
  void print(int number, const Minute& m) const {
    const double views = double(std::max<uint64_t>(m.views, 1)), seconds = views / o_.views_per_s;
    std::printf("%6d %8.0f %9.0f %9.0f %9.0f %8.1f %9.2f %9.2f %8.2f %8.3f %9.1f %9.3f %9.2f %9.2f %12.0f %10.2f\n",
                number, median(m.clusters), median(m.items), median(m.points), m.cached, m.bytes_a_point,
                median(m.select_ms), median(m.splat_ms), median(m.psnr_db), median(m.holes),
                m.sent_points / seconds * 1e-3, m.sent_mb / seconds, m.pack_ms / views, m.insert_ms / views,
                m.at_once_items, m.at_once_ms);
    std::fflush(stdout);
  }

  const CacheOptions& o_;
  launcher::DirectScene& scene_;
  Walk walk_;
  std::pair<int, int> display_, sampling_;
  points::ModelConfig config_;
  packer::PackerCore packer_;
  viewer::ModelCache cache_;
  splat::CpuSplatter splatter_;
  splat::DrawList list_;
  image::View frame_;
  tools::ProgressLine progress_;
  uint64_t frames_ = 0;
};

options::Table table(CacheOptions& o) {
  using options::Range;
  return joined(
      {{.flag = "path", .value = &o.data.scene, .help = "mesh file, or with --iso a volume", .required = true},
       {.flag = "--trajectory",
        .value = &o.trajectory,
        .help = "orbit, or CSV files of poses with commas between, walked one after the other, round and round"},
       {.flag = "--minutes",
        .value = &o.minutes,
        .help = "of the walk, which takes as long as it takes",
        .limits = Range{0.05, 1000}},
       {.flag = "--views-per-s",
        .value = &o.views_per_s,
        .help = "views sampled in a second of the walk",
        .limits = Range{0.1, 100}},
       {.flag = "--latency",
        .value = &o.latency_s,
        .help = "seconds by which the display is ahead of the newest view",
        .limits = Range{0, 10}},
       {.flag = "--size", .value = &o.size, .help = "display size in pixels, WxH"},
       {.flag = "--sampling-size",
        .value = &o.sampling_size,
        .help = "size of the views sampled, WxH; default: the display's"},
       {.flag = "--fov", .value = &o.fov_deg, .help = "horizontal field of view in degrees", .limits = Range{1, 170}},
       {.flag = "--octree-depth",
        .value = &o.octree_depth,
        .help = "levels of the point model's octree; 0: as sessions have them",
        .limits = Range{0, 10}},
       {.flag = "--splat", .value = &o.splat, .help = "kernel", .limits = splat::kernel_names()},
       {.flag = "--splat-scale",
        .value = &o.splat_scale,
        .help = "scale factor of splat sizes; 0: what suits the kernel",
        .limits = Range{0, 10}},
       {.flag = "--nearest",
        .value = &o.nearest,
        .help = "pixels: samples that have a point of the model so near are not packed; below 0: as sessions have it",
        .limits = Range{-1, 1}},
       {.flag = "--threads",
        .value = &o.threads,
        .help = "threads to sample and draw with; 0: one a core",
        .limits = Range{0, 1024}},
       {.flag = "--out",
        .value = &o.out,
        .help = "folder for pictures of every compared frame, beside direct rendering"}},
      data::scene_table(o.data));
}

// Columns: median clusters, draw items and points of a frame; points cached, bytes each; median times; quality against
// direct rendering; what was sent; times a view; and of the newest view, items and time of a model made at once.
int cache(CacheOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat-lab", "warn");
  const auto display = viewer::parse_size(o.size, "--size");
  if (!display) return tools::complain(display.error());
  const auto sampling = o.sampling_size.empty() ? display : viewer::parse_size(o.sampling_size, "--sampling-size");
  if (!sampling) return tools::complain(sampling.error());
  auto walk = Walk::open(o.trajectory);
  if (!walk) return tools::complain(walk.error());
  std::error_code error;
  if (!o.out.empty() && !(std::filesystem::create_directories(o.out, error), std::filesystem::is_directory(o.out)))
    return tools::complain({fmt::format("--out {}: cannot be made: {}", o.out, error.message())});
  const auto scene = launcher::scene_of(o.data);
  if (!scene) return tools::complain(scene.error());
  tools::ProgressLine progress;
  const auto direct = (*scene)->open_direct(o.threads, [&](const char* stage, double fraction) {
    progress.show(fmt::format("{}: {} {:.0f} %", o.data.scene, stage, 100 * fraction));
  });
  progress.close();
  if (!direct) return tools::complain(direct.error());
  CacheBench bench(o, **direct, std::move(*walk), *display, *sampling);
  if (const Status s = bench.run(); !s) return tools::complain(s.error(), 1);
  return net::stop_requested() ? tools::complain({"told to stop"}, 1) : 0;
}

}  // namespace

launcher::Command cache_command() {
  return launcher::make_command(
      "cache", "measure what a point model costs, minute by minute of a walk that is replayed without waiting", table,
      cache);
}

}  // namespace telesplat::lab
