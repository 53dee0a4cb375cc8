// Decides which of two renderers draws quicker: both draw a session's own first frames by turns.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/clock.h"

namespace telesplat::viewer {

/// The renderer that a session keeps, and the reason. The display's thread writes it, others read it.
class RendererChoice {
 public:
  struct Figures {
    std::string kept;              ///< "cpu" or "gl"; empty: both are still timed
    double cpu_ms = 0, gl_ms = 0;  ///< medians of the timed frames; 0: there was only one renderer
  };
  void set(Figures figures);
  Figures get() const;

 private:
  mutable std::mutex mutex_;
  Figures figures_;
};

/// Times two renderers, 0 and 1. Times come as arguments.
///
/// A frame counts if it shows something and is as large as the largest so far; a larger one begins anew. The first
/// kWarmUp frames of each renderer do not count, because they upload points and compile shaders. The trial ends kSpan_s
/// after its first frame, once each renderer has kLeast frames; after kFew frames of each it ends if one renderer takes
/// kClear times as long as the other.
class RendererTrial {
 public:
  static constexpr size_t kWarmUp = 2, kFew = 3, kLeast = 5;
  static constexpr double kSpan_s = 1, kClear = 2;

  /// The renderer that draws the next frame.
  size_t next() const { return frames_[0] <= frames_[1] ? 0 : 1; }
  /// Renderer next() has drawn a frame of this size in `ms`, until now_s.
  void add(size_t pixels, double ms, double now_s);
  /// The quicker one; nothing: the trial goes on.
  std::optional<size_t> quicker() const { return quicker_; }
  /// Median of a renderer's timed frames, milliseconds; 0: it has no timed frames.
  double median_ms(size_t renderer) const;

 private:
  std::array<std::vector<double>, 2> ms_;
  std::array<size_t, 2> frames_{};
  size_t pixels_ = 0;
  double begin_s_ = 0;
  std::optional<size_t> quicker_;
};

/// Two renderers under trial, the processor's first; afterwards the one that is kept. The other is destroyed.
/// R: Renderer or VolumeRenderer. now_s: the clock that times frames.
template <class R>
class TriedRenderers {
 public:
  TriedRenderers(std::unique_ptr<R> cpu, std::unique_ptr<R> gl, std::shared_ptr<RendererChoice> choice,
                 std::function<double()> now_s = monotonic_s)
      : renderers_{std::move(cpu), std::move(gl)}, choice_(std::move(choice)), now_s_(std::move(now_s)) {}

  /// The renderer that is kept; null: both are still timed.
  const R* kept() const { return kept_; }
  R& next() const { return kept_ ? *kept_ : *renderers_[trial_.next()]; }
  /// Calls draw(renderer). pixels: size of the frame; 0 if it shows nothing.
  template <class Draw>
  auto draw(size_t pixels, const Draw& draw) {
    if (kept_ || pixels == 0) return draw(next());
    const double begin_s = now_s_();
    auto out = draw(next());
    const double end_s = now_s_();
    trial_.add(pixels, (end_s - begin_s) * 1e3, end_s);
    if (const auto quicker = trial_.quicker()) keep(*quicker);
    return out;
  }

 private:
  void keep(size_t quicker) {
    kept_ = renderers_[quicker].get();
    renderers_[1 - quicker].reset();
    choice_->set({kept_->name(), trial_.median_ms(0), trial_.median_ms(1)});
  }

  std::array<std::unique_ptr<R>, 2> renderers_;
  R* kept_ = nullptr;
  RendererTrial trial_;
  std::shared_ptr<RendererChoice> choice_;
  std::function<double()> now_s_;
};

}  // namespace telesplat::viewer
