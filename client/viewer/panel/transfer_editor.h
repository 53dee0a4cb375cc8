// A volume's transfer function while a person changes it: points are dragged, added, taken away. No window, no OpenGL.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/volume/histogram.h"
#include "common/volume/session.h"

namespace telesplat::viewer {

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
  /// What an editor shows: the data's values, and points beyond them.
  double lo() const;
  double hi() const;

  // ---- the person; true: the function has changed ----
  /// A point stays between its neighbours; opacity 0 to 1.
  bool move(double now_s, size_t index, double value, double opacity);
  /// On the curve, with its colour and opacity. False also where the function has no room for more.
  bool add(double now_s, double value);
  /// The last two stay.
  bool remove(double now_s, size_t index);
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
