#include "client/displays/window/measuring.h"

#include <fmt/format.h>

#include <utility>

#include "client/displays/window/screenshots.h"
#include "client/viewer/hands/errands.h"
#include "common/core/clock.h"
#include "common/core/whole_file.h"
#include "common/core/within.h"

namespace telesplat::viewer {

constexpr double kPoint_s = 0.1;

// The cursor's overlay is updated only a few times a second.
std::optional<glm::dvec2> Measuring::points_at() {
  tells_pick_ = interaction_.take(Wish::kPick);
  centres_ = centres_ || interaction_.take(Wish::kCentre);
  const double now_s = monotonic_s();
  const auto pointer = interaction_.pointer();
  if (!pointer || (!tells_pick_ && !centres_ && (!hands_.shows("cursor") || now_s - pointed_s_ < kPoint_s)))
    return std::nullopt;
  pointed_s_ = now_s;
  const glm::dvec2 at = *pointer * double(window_.height());
  if (!(at.x >= 0 && at.y >= 0 && at.x < window_.width() && at.y < window_.height())) return std::nullopt;
  return at / glm::dvec2(window_.width(), window_.height());
}

void Measuring::on_pick(const std::optional<Pick>& pick, EpochId epoch, const SceneTerms* terms) {
  hands_.on_pick(pick);
  if (std::exchange(centres_, false) && pick) interaction_.centre_on(pick->position_room);
  if (!std::exchange(tells_pick_, false) || !terms) return;
  if (!pick)
    return tell_(interaction_.pipeline() == scene::Pipeline::kPictures
                     ? "a picture has no depth: nothing in it can be measured"
                     : "nothing lies under the cursor");
  if (const auto added = places_.add(*pick, *terms, epoch, kPickOpacity); !added) tell_(added.error().text);
}

void Measuring::clear() {
  places_.clear();
  hands_.on_pick(std::nullopt);
}

// Draws the marks anew only if they have changed.
void Measuring::show_marks(const geometry::Camera& camera, bool seen) {
  const auto& [p, q] = camera.pose;
  const bool shown = !places_.empty() && seen;
  const std::string state = !shown ? ""
                                   : fmt::format("{} {} {} {} {} {} {} {} {} {} {}", places_.version(), p.x, p.y, p.z,
                                                 q.w, q.x, q.y, q.z, camera.left, camera.width, camera.height);
  if (state == std::exchange(marks_shown_, state)) return;
  auto marks = shown ? draw_marks(places_, camera, within(camera.height / 400, 1, 4)) : MarksPicture{};
  overlays_.show("marks", {std::move(marks.view), Overlay::Corner::kNone, marks.x, marks.y});
}

void Measuring::save(const std::string& folder) const {
  const std::string name = new_file(folder, "measurements", ".csv");
  const Status saved = write_whole(name, places_.csv());
  tell_(saved ? "measurements: " + name : saved.error().text);
}

}  // namespace telesplat::viewer
