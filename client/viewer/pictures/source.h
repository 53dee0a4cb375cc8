// The display's source where views come as pictures: the picture as it came, for the pose that was asked for. It is
// scaled where the display has another size by now.
#pragma once

#include "client/viewer/display/view_source.h"
#include "client/viewer/pictures/received_pictures.h"

namespace telesplat::viewer {

class PictureSource final : public ViewSource {
 public:
  explicit PictureSource(PictureShelf& shelf) : shelf_(shelf) {}

  void advance(RequestId request) override { shelf_.advance(request); }
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  /// Both eyes see the same.
  DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                       const std::array<splat::FrameTarget, 2>& targets) override;
  /// A picture tells of no place.
  std::optional<Pick> pick(const geometry::Camera&, double, double, double) override { return std::nullopt; }
  const char* drawn_name() const override { return "pixels"; }
  const char* cached_name() const override { return " pixels"; }

 private:
  PictureShelf& shelf_;
  std::shared_ptr<const ShownPicture> drawn_;  // last
};

/// Colours of `from` at the size of `to`, between its four nearest pixels each.
void scale_into(const image::View& from, image::View& to);

}  // namespace telesplat::viewer
