// One picture of two eyes' pictures for a panel with a line screen: each subpixel gets the eye that sees it.
#pragma once

#include <cstdint>
#include <vector>

#include "client/stereo/autostereo/panel.h"
#include "common/image/file.h"

namespace telesplat::stereo {

/// Keeps its memory from one picture to the next. Used by one thread; draws with all that TBB has.
class Interleaver {
 public:
  /// Precondition: the panel validates.
  explicit Interleaver(const Panel& panel) : panel_(panel) {}

  const Panel& panel() const { return panel_; }

  /// `out` gets the panel's size, without depth. The eyes' pictures have one size, any; they are stretched over the
  /// panel, linearly between their pixels. Subpixels of guard bands are black. Preconditions: the eyes validate
  /// (panel.h).
  void compose(const Eyes& eyes, const image::View& left, const image::View& right, image::View& out);

  /// Whose each subpixel is: 0xff in the bits of the left eye's colours (0x00RRGGBB); the same of the right's. For one
  /// row of the panel.
  void masks(const Eyes& eyes, int row, std::vector<uint32_t>& left, std::vector<uint32_t>& right);

 private:
  static constexpr int kCell = 32;  // pixels a side, within which lines are taken to be straight and even

  void find_lines(const Eyes& eyes);
  void share_out(int row, uint32_t* left, uint32_t* right) const;
  void stretch(const image::View& from, int row, uint32_t* to) const;
  void prepare_stretch(int width);

  Panel panel_;
  Eyes eyes_{};
  // line_at() of each eye in the corners of cells, by rows, for the middle of the first subpixel of the pixel there.
  std::vector<double> lines_[2];
  bool lines_known_ = false;
  // Of each column of the panel: where it lies in an eye's picture, left pixel and how much of the one beside it (of
  // 256).
  std::vector<uint32_t> column_, beside_;
  int stretched_width_ = 0;
};

/// How much of a subpixel an eye sees, 0 to 1: the share of its width from which light reaches the eye through a slit
/// (or by way of a lens).
double visible_share(const Panel& panel, const glm::dvec3& eye, int x, int y, int subpixel);

/// What an eye at this place sees of the picture on the panel. Eyes do not resolve lines: a pixel's channel is the mean
/// of that channel around it, over a pitch to each side of its row, weighted by what is visible of it; as bright as if
/// all of it were. Preconditions: the panel and the eye validate; the picture has the panel's size.
image::View seen_by(const Panel& panel, const glm::dvec3& eye, const image::View& picture);

/// What eyes see of a panel through its line screen: simulated, for calibration, documents and tests.
struct SeenShares {
  double crosstalk = 0;  ///< of the light that an eye sees: how much is of subpixels that belong to the other one
  double dark = 0;       ///< of the subpixels: how many belong to nobody
};
/// For a picture that was made for `made_for`, seen from there: rows about the middle of the panel.
SeenShares seen_shares(const Panel& panel, const Eyes& made_for);

}  // namespace telesplat::stereo
