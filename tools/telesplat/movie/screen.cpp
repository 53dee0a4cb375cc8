#include "tools/telesplat/movie/screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "client/wall/screen_camera.h"
#include "common/image/canvas.h"
#include "common/scene/legend.h"
#include "tools/telesplat/scene/epochs.h"

namespace telesplat::launcher {
namespace {

constexpr int64_t kMaxPixels = 64 << 20;

}  // namespace

Result<Screen> Screen::open(const std::string& directory, int width, int height, const char* size_flag, int threads) {
  auto runs = read_recorded_displays(directory);
  if (!runs) return runs.error();
  Screen out;
  for (auto& run : *runs) {
    Tile& tile = out.tiles_.emplace_back();
    tile.run = std::make_unique<RecordedRun>(std::move(run));
    if (tile.run->stereo.on()) tile.rig = std::make_unique<viewer::EyeRig>(tile.run->stereo);
  }
  if (const Status s = out.choose_size(width, height, size_flag); !s) return s.error();
  if (const Status s = out.open_replays(threads); !s) return s.error();
  if (out.run().legend && !out.run().stereo.on())
    if (const Status s = out.read_legends(directory); !s) return s.error();
  out.find_times();
  return out;
}

// Lays a described wall flat, with the gaps of its bezels.
Status Screen::choose_size_of_description(int width, int height, const char* size_flag) {
  const auto flat = wall::unrolled(*run().wall.described);
  if (!flat) return flat.error();
  width_ = width ? width : flat->width;
  height_ = height ? height : flat->height;
  if (int64_t{width_} * height_ > kMaxPixels)
    return Error{fmt::format("{} {}x{}: at most {} pixels", size_flag, width_, height_, kMaxPixels)};
  const double x = double(width_) / flat->width, y = double(height_) / flat->height;
  for (const auto& p : flat->places)
    places_.push_back({int(p.x * x), int(p.y * y), std::max(1, int(p.width * x)), std::max(1, int(p.height * y))});
  return ok_status();
}

// All tiles of a wall have one size.
Status Screen::choose_size(int width, int height, const char* size_flag) {
  const RecordedRun& first = run();
  if (first.wall.described) return choose_size_of_description(width, height, size_flag);
  const int columns = first.wall.columns, rows = first.wall.rows;
  if (first.stereo.panel && width && (width != first.width || height != first.height))
    return Error{fmt::format("{} {}x{}: pictures for an autostereo display have its pixels, {}x{}", size_flag, width,
                             height, first.width, first.height)};
  width_ = width ? width : first.width * columns;
  height_ = height ? height : first.height * rows;
  if (width_ % columns || height_ % rows)
    return Error{fmt::format("{} {}x{}: the run has a wall of {}x{} displays, which share it evenly", size_flag, width_,
                             height_, columns, rows)};
  if (int64_t{width_} * height_ > kMaxPixels)
    return Error{fmt::format("{} {}x{}: at most {} pixels", size_flag, width_, height_, kMaxPixels)};
  const int across = width_ / columns, down = height_ / rows;
  for (int i = 0; i < columns * rows; ++i) places_.push_back({i % columns * across, i / columns * down, across, down});
  return ok_status();
}

Status Screen::open_replays(int threads) {
  for (Tile& tile : tiles_) {
    auto replay = FrameReplay::open(*tile.run, tile.run->renderer, threads);
    // Without a GPU, draws a record of the gl renderer with cpu.
    if (!replay && tile.run->renderer == "gl") {
      const std::string why = replay.error().text;
      replay = FrameReplay::open(*tile.run, "cpu", threads);
      if (replay && notes_.empty()) notes_.push_back("drawn by the cpu renderer instead of gl: " + why);
    }
    if (!replay) return replay.error();
    tile.replay = std::move(*replay);
  }
  return ok_status();
}

// Epochs with the same legend share it.
Status Screen::read_legends(const std::string& directory) {
  std::map<std::string, std::string> told;
  std::shared_ptr<const image::Legend> legend;
  return read_epochs(directory, {"epoch"}, [&](uint64_t epoch, tools::CsvRow& row) {
    std::map<std::string, std::string> facts;
    for (const char* name : {scene::kColouringFact, "transfer"})
      if (std::string text = row.text(name); !text.empty()) facts[name] = std::move(text);
    if (facts != told) {
      const auto read = scene::legend_of(facts, row.numbers());
      legend = read ? std::make_shared<const image::Legend>(*read) : nullptr;
      told = std::move(facts);
    }
    if (legend) legends_[EpochId{epoch}] = legend;
    return ok_status();
  });
}

// The tiles of a wall use one clock.
void Screen::find_times() {
  double end_s = run().frames.back().shown_s;
  begin_s_ = run().frames.front().shown_s;
  for (const Tile& tile : tiles_) {
    begin_s_ = std::max(begin_s_, tile.run->frames.front().shown_s);
    end_s = std::min(end_s, tile.run->frames.back().shown_s);
  }
  duration_s_ = std::max(0.0, end_s - begin_s_);
}

Result<Screen::Shown> Screen::show(double t_s) {
  bool changed = false;
  for (Tile& tile : tiles_) {
    const auto& frames = tile.run->frames;
    while (tile.frame + 1 < frames.size() && frames[tile.frame + 1].shown_s - begin_s_ <= t_s) {
      ++tile.frame;
      tile.drawn = false;
    }
    if (tile.drawn) continue;
    const auto there = draw(tile);
    if (!there) return there.error();
    if (!*there) return Shown::kRecordEnds;
    changed = true;
  }
  if (!changed) return Shown::kSame;
  ++drawn_;
  compose();
  if (const auto legend = legends_.find(frame().epoch); legend != legends_.end())
    image::draw_legend(view_, *legend->second);
  return Shown::kNew;
}

Result<bool> Screen::draw(Tile& tile) {
  const RecordedRun& run = *tile.run;
  const DisplayedFrame& frame = run.frames[tile.frame];
  const geometry::Rect& place = places_[size_t(run.wall.tile)];
  const geometry::Camera camera = run.camera_at(frame.head, place.width, place.height);
  if (const Status s = geometry::validate(camera); !s)
    return Error{fmt::format("frame {}: {}", frame.number, s.error().text)};
  const auto there = tile.rig ? draw_pair(tile, frame, camera) : tile.replay->draw(frame, camera, tile.view);
  if (there && *there) tile.drawn = true;
  return there;
}

// Composed pictures may be a row or a column smaller than the display, whose sides may be odd.
Result<bool> Screen::draw_pair(Tile& tile, const DisplayedFrame& frame, const geometry::Camera& camera) {
  const viewer::EyePair pair = viewer::recorded_eyes(tile.run->stereo, camera, frame.screen_m, frame.eyes_room);
  const auto there = tile.replay->draw_pair(frame, pair, tile.eyes);
  if (!there || !*there) return there;
  tile.rig->draw_pattern(tile.eyes);
  tile.rig->compose(pair, tile.eyes, false, tile.view);
  const geometry::Rect& place = places_[size_t(tile.run->wall.tile)];
  const int width = place.width, height = place.height;
  if (tile.view.width == width && tile.view.height == height) return true;
  image::Canvas canvas(width, height, 0xff000000u);
  canvas.place(tile.view, 0, 0);
  tile.view = canvas.view();
  return true;
}

void Screen::compose() {
  if (tiles_.size() == 1) {
    view_ = tiles_.front().view;
    return;
  }
  image::Canvas canvas(width_, height_, 0xff000000u);
  for (const Tile& tile : tiles_) {
    const geometry::Rect& place = places_[size_t(tile.run->wall.tile)];
    canvas.place(tile.view, place.x, place.y);
  }
  view_ = canvas.view();
}

const DisplayedFrame& Screen::frame() const { return run().frames[tiles_.front().frame]; }

std::string Screen::record_file() const { return std::filesystem::path(record_path(run())).filename().string(); }

}  // namespace telesplat::launcher
