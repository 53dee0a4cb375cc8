#include "client/viewer/render/renderer_trial.h"

#include <algorithm>

#include "common/core/log.h"

namespace telesplat::viewer {

void RendererChoice::set(Figures figures) {
  if (figures.cpu_ms > 0 && figures.gl_ms > 0)
    log::info("the {} renderer draws: a frame takes {:.1f} ms on the processor and {:.1f} ms by OpenGL", figures.kept,
              figures.cpu_ms, figures.gl_ms);
  const std::lock_guard lock(mutex_);
  figures_ = std::move(figures);
}

RendererChoice::Figures RendererChoice::get() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

void RendererTrial::add(size_t pixels, double ms, double now_s) {
  if (quicker_ || pixels < pixels_) return;
  if (pixels > pixels_) {
    pixels_ = pixels;
    begin_s_ = now_s - ms / 1e3;
    frames_ = {};
    for (auto& of_one : ms_) of_one.clear();
  }
  const size_t drawn_by = next();
  if (++frames_[drawn_by] > kWarmUp) ms_[drawn_by].push_back(ms);
  const size_t timed = std::min(ms_[0].size(), ms_[1].size());
  if (timed < kFew) return;
  const double first = median_ms(0), second = median_ms(1);
  const bool clear = std::max(first, second) >= kClear * std::min(first, second);
  if (clear || (timed >= kLeast && now_s - begin_s_ >= kSpan_s)) quicker_ = first <= second ? 0 : 1;
}

double RendererTrial::median_ms(size_t renderer) const {
  auto ms = ms_[renderer];
  if (ms.empty()) return 0;
  const auto middle = ms.begin() + long(ms.size() / 2);
  std::nth_element(ms.begin(), middle, ms.end());
  return *middle;
}

}  // namespace telesplat::viewer
