#include "tests/support/xr/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

namespace telesplat::xr_test {
namespace {

constexpr size_t kMostMistakes = 100;

}  // namespace

Recorder::Recorder(const std::string& directory) : directory_(directory) {
  if (directory_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  frames_.open(directory_ + "/frames.csv");
  frames_ << "frame,display_s,submitted_s,shown_s,late,missed,layers,depth,discarded,px,py,pz,qw,qx,qy,qz\n";
  thread_ = std::thread([this] { write_loop(); });
}

Recorder::~Recorder() {
  if (directory_.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Recorder::flush() {
  if (directory_.empty()) return;
  frames_.flush();
  const nlohmann::ordered_json out{
      {"calls", calls_},      {"mistakes", mistakes_},       {"frames_shown", shown_},
      {"frames_late", late_}, {"refreshes_missed", missed_}, {"pictures_dropped", dropped_}};
  std::ofstream(directory_ + "/calls.json") << out.dump(2) << '\n';
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_.empty() && !writing_; });
}

void Recorder::mistake(const std::string& text) {
  std::fprintf(stderr, "xr test runtime: %s\n", text.c_str());
  if (mistakes_.size() < kMostMistakes) mistakes_.push_back(text);
}

void Recorder::frame(const Frame& f, double period_s) {
  const bool late = f.layers && f.shown_s > f.display_s + 0.5 * period_s;
  int missed = 0;
  if (f.layers) {
    if (last_shown_s_ > 0) missed = std::max(0, int(std::lround((f.shown_s - last_shown_s_) / period_s)) - 1);
    last_shown_s_ = f.shown_s;
    ++shown_;
    late_ += late;
    missed_ += uint64_t(missed);
  }
  if (first_s_ == 0) first_s_ = f.display_s;
  const auto& p = f.left.position_room;
  const auto& q = f.left.orientation;
  frames_ << fmt::format(
      "{},{:.6f},{:.6f},{:.6f},{:d},{},{:d},{:d},{:d},{:.6f},{:.6f},{:.6f},{:.7f},{:.7f},{:.7f},{:.7f}\n", f.number,
      f.display_s - first_s_, f.submitted_s - first_s_, f.shown_s - first_s_, late, missed, f.layers, f.depth,
      f.discarded, p.x, p.y, p.z, q.w, q.x, q.y, q.z);
}

void Recorder::picture(const std::string& name, image::View view, bool exr) {
  if (directory_.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostWaiting) {
      ++dropped_;
      return;
    }
    waiting_.push_back({name, std::move(view), exr});
  }
  changed_.notify_one();
}

void Recorder::write_loop() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Picture picture = std::move(waiting_.front());
    waiting_.pop_front();
    writing_ = true;
    lock.unlock();
    const std::string path = directory_ + "/" + picture.name;
    if (const Status s = image::write_png(path + ".png", picture.view); !s)
      std::fprintf(stderr, "xr test runtime: %s\n", s.error().text.c_str());
    if (picture.exr && !picture.view.depth_m.empty())
      if (const Status s = image::write_exr(path + ".exr", picture.view); !s)
        std::fprintf(stderr, "xr test runtime: %s\n", s.error().text.c_str());
    lock.lock();
    writing_ = false;
    changed_.notify_all();
  }
}

}  // namespace telesplat::xr_test
