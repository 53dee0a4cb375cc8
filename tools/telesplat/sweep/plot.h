// A small plot of one figure as SVG: medians with whiskers from the least to the most value, over a few categories.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace telesplat::launcher {

struct PlotPoint {
  double median = 0, least = 0, most = 0;
  std::string tip;     ///< what a person sees who points at it; lines end with \n
  bool noisy = false;  ///< drawn with a dashed whisker
};

struct PlotSeries {
  int colour = 0;                                ///< class c0, c1, ... of the page's style
  std::vector<std::optional<PlotPoint>> points;  ///< one a category
};

struct Plot {
  std::string title;  ///< empty: none
  std::vector<std::string> categories;
  std::vector<PlotSeries> series;
  bool lines = false;  ///< the categories are numbers: medians are joined; else bars
};

/// Values that an axis tells, and its ends.
struct Scale {
  double low = 0, high = 1, step = 1;
};
/// Round numbers, about four of them, from below the least value, or from 0, to above the most.
Scale scale_of(double least, double most, bool from_zero);

/// Text for HTML and SVG: what means something there is replaced.
std::string escaped(const std::string& text);

std::string to_svg(const Plot& plot, const Scale& scale);

}  // namespace telesplat::launcher
