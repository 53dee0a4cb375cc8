// Composes two eyes' pictures for a panel with a line screen: a subpixel shows the picture of the eye that sees it.
#pragma once

#include <cstdint>
#include <vector>

#include "client/stereo/autostereo/panel.h"
#include "common/image/file.h"

namespace telesplat::stereo {

/// Keeps its memory from one picture to the next. Used by one thread; draws with all threads of TBB.
class Interleaver {
 public:
  /// Precondition: the panel validates.
  explicit Interleaver(const Panel& panel) : panel_(panel) {}

  const Panel& panel() const { return panel_; }

  /// `out` gets the panel's size, without depth. Both pictures have one size, which may be any; they are stretched over
  /// the panel, linearly between their pixels. Subpixels of guard bands are black. Precondition: the eyes validate
  /// (panel.h).
  void compose(const Eyes& eyes, const image::View& left, const image::View& right, image::View& out);

  /// Fills the masks of one row of the panel: 0xff in the bits of the colours (0x00RRGGBB) that belong to the left eye,
  /// and the same for the right one.
  void masks(const Eyes& eyes, int row, std::vector<uint32_t>& left, std::vector<uint32_t>& right);

 private:
  static constexpr int kCell = 32;  // pixels a side; within a cell lines count as straight and even

  void find_lines(const Eyes& eyes);
  void share_out(int row, uint32_t* left, uint32_t* right) const;
  void stretch(const image::View& from, int row, uint32_t* to) const;
  void prepare_stretch(int width);

  Panel panel_;
  Eyes eyes_{};
  // line_at() of each eye in the corners of cells, by rows, for the middle of the first subpixel of the pixel there.
  std::vector<double> lines_[2];
  bool lines_known_ = false;
  // For each column of the panel: the pixel of an eye's picture to the left of it, and the weight of the pixel after
  // that (0 to 256).
  std::vector<uint32_t> column_, beside_;
  int stretched_width_ = 0;
};

/// Returns the share of a subpixel that an eye sees, 0 to 1: the part of its width from which light reaches the eye
/// through a slit (or a lens).
double visible_share(const Panel& panel, const glm::dvec3& eye, int x, int y, int subpixel);

/// Returns what an eye at this place sees of the picture on the panel. Eyes do not resolve lines: a pixel's channel is
/// the mean of that channel over a pitch to each side in its row, weighted by visible_share(), as bright as if all of
/// it were visible. Preconditions: the panel and the eye validate; the picture has the panel's size.
image::View seen_by(const Panel& panel, const glm::dvec3& eye, const image::View& picture);

/// Figures of eyes that see a panel through its line screen: simulated, for calibration, documents and tests.
struct SeenShares {
  double crosstalk = 0;  ///< share of an eye's light that comes from the other eye's subpixels
  double dark = 0;       ///< share of subpixels in guard bands
};
/// Computes them for a picture made for these eyes, which look from there; over rows about the panel's middle.
SeenShares seen_shares(const Panel& panel, const Eyes& made_for);

}  // namespace telesplat::stereo
