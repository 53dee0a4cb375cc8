// A volume's transfer function while a person edits it: drags, adds and removes points. No window, no OpenGL.
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
/// Returns the bars that lie on an axis from lo to hi.
std::vector<HistogramBar> bars_of(const volume::Histogram& histogram, double lo, double hi, bool logarithmic);

/// After each change the session's function and the person's differ for a moment: the person's stays on display until
/// the session has it or kPatience_s is over. Used by one thread.
class TransferEditor {
 public:
  static constexpr double kPatience_s = 3;
  using Point = volume::TransferFunction::Point;

  /// Takes the session as it is now. histogram null: the distribution of its values is not known.
  void on_session(double now_s, const volume::Session& session, const std::optional<volume::Histogram>& histogram);
  /// The session refused the person's function.
  void on_refusal();

  const volume::TransferFunction& transfer() const { return wanted_; }
  const std::optional<volume::Histogram>& histogram() const { return histogram_; }
  const volume::ValueRange& range() const { return range_; }
  // ---- the axis: the data's range of values, independent of the points; never empty ----
  double lo() const;
  double hi() const;
  /// Place of a value on the axis: 0 at lo(), 1 at hi(); beyond them -1 to 2 at most.
  double share(double value) const;
  double value_at(double share) const;
  std::vector<HistogramBar> bars(bool logarithmic) const;
  /// A place of the opacity's curve, from end to end of the axis.
  struct Spot {
    double share = 0, opacity = 0;
  };
  std::vector<Spot> curve() const;
  /// Width from the first to the last point, and its middle.
  double window() const { return wanted_.points.back().value - wanted_.points.front().value; }
  double level() const { return wanted_.points.front().value + window() / 2; }

  // ---- the person; true: the function has changed ----
  /// Moves a point; it stays between its neighbours, and may lie beyond the axis; opacity 0 to 1.
  bool move(double now_s, size_t index, double value, double opacity);
  /// Adds a point on the curve, with the colour and opacity there. Also false if the function has no room for it.
  bool add(double now_s, double value);
  /// Removes a point, but not one of the last two.
  bool remove(double now_s, size_t index);
  /// Moves and stretches the whole function. If all points had one value, they are spread evenly.
  bool set_window(double now_s, double window, double level);
  /// Stretches the function from one end of the axis to the other.
  bool fit(double now_s) { return set_window(now_s, hi() - lo(), lo() + (hi() - lo()) / 2); }
  bool colour(double now_s, size_t index, float r, float g, float b);

  /// The person's function as text, for an order.
  std::string text() const { return volume::to_text(wanted_); }
  /// Writes a ParaView JSON file. Error: names the file.
  Status save(const std::string& path, std::string_view name) const;

 private:
  bool change(double now_s, volume::TransferFunction next);

  volume::TransferFunction told_{{{}}}, wanted_{{{}}};
  volume::ValueRange range_;
  std::optional<volume::Histogram> histogram_;
  double changed_s_ = -1e9;  // the person's last change; the session's answer is awaited
};

}  // namespace telesplat::viewer
