// A volume's transfer function while a person changes it: points are dragged, added, taken away. No window, no OpenGL.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/volume/histogram.h"
#include "common/volume/session.h"

namespace telesplat::viewer {

struct HistogramBar {
  double from = 0, to = 0, height = 0;  ///< shares of the axis and of the highest bar
};
/// As far as they lie on an axis from lo to hi.
std::vector<HistogramBar> bars_of(const volume::Histogram& histogram, double lo, double hi, bool logarithmic);

/// What the session has and what the person wants differ for a moment after each change: what is wanted stays on
/// display until the session has it or kPatience_s is over. One thread.
class TransferEditor {
 public:
  static constexpr double kPatience_s = 3;
  using Point = volume::TransferFunction::Point;

  /// The session as it is now. Null: nothing is known of its values.
  void on_session(double now_s, const volume::Session& session, const std::optional<volume::Histogram>& histogram);
  /// The session will not have what was wanted.
  void on_refusal();

  const volume::TransferFunction& transfer() const { return wanted_; }
  const std::optional<volume::Histogram>& histogram() const { return histogram_; }
  const volume::ValueRange& range() const { return range_; }
  // ---- the axis: the data's values, whichever points there are; never empty ----
  double lo() const;
  double hi() const;
  /// Where a value lies on the axis: 0 at lo(), 1 at hi(); beyond them -1 to 2 at most.
  double share(double value) const;
  double value_at(double share) const;
  std::vector<HistogramBar> bars(bool logarithmic) const;
  /// Opacity over the axis, from end to end.
  struct Spot {
    double share = 0, opacity = 0;
  };
  std::vector<Spot> curve() const;
  /// From the first to the last point: how wide, and the middle.
  double window() const { return wanted_.points.back().value - wanted_.points.front().value; }
  double level() const { return wanted_.points.front().value + window() / 2; }

  // ---- the person; true: the function has changed ----
  /// A point stays between its neighbours, and may lie beyond the axis; opacity 0 to 1.
  bool move(double now_s, size_t index, double value, double opacity);
  /// On the curve, with its colour and opacity. False also where the function has no room for more.
  bool add(double now_s, double value);
  /// The last two stay.
  bool remove(double now_s, size_t index);
  /// Moves and stretches the whole function. Points that all stood at one value are spread evenly.
  bool set_window(double now_s, double window, double level);
  /// From one end of the axis to the other.
  bool fit(double now_s) { return set_window(now_s, hi() - lo(), lo() + (hi() - lo()) / 2); }
  bool colour(double now_s, size_t index, float r, float g, float b);

  /// The text form of what is wanted, for an order.
  std::string text() const { return volume::to_text(wanted_); }
  /// As a ParaView JSON file. Error: names the file.
  Status save(const std::string& path, std::string_view name) const;

 private:
  bool change(double now_s, volume::TransferFunction next);

  volume::TransferFunction told_{{{}}}, wanted_{{{}}};
  volume::ValueRange range_;
  std::optional<volume::Histogram> histogram_;
  double changed_s_ = -1e9;  // by the person; what the session has is waited for
};

}  // namespace telesplat::viewer
