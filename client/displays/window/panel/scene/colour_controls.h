// What a person can change of a mesh's colours: the array, its range, the map; and the value of an isosurface. Orders
// come out, as `telesplat ctl` gives them. No window, no OpenGL, no sockets.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/window/panel/order.h"
#include "client/displays/window/panel/transfer_editor.h"
#include "common/scene/colouring.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// One thread.
class ColourControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;  ///< a range that was set is shown until the session has it, so long

  explicit ColourControls(Give give) : give_(std::move(give)) {}

  void on_session(double now_s, const wire::Welcome& session);
  void on_refusal() { wished_.reset(); }

  /// What the mesh can be coloured by: arrays, and of vectors their components too; empty: nothing.
  const std::vector<std::string>& arrays() const { return arrays_; }
  /// Nothing: by its own colours.
  const std::optional<scene::Colouring>& colouring() const { return colouring_; }
  /// Of the colouring, as it is or was set and is not yet.
  std::pair<double, double> range() const;
  /// All values of its array; empty: not known.
  scene::ValueSpan whole_range() const;

  /// By its whole range, in the colours of now. scene::kNoArray: the file's own colours.
  void choose_array(const std::string& name);
  /// lo below hi; else nothing happens.
  void choose_range(double now_s, double lo, double hi);
  void reset_range();
  void choose_map(const colour::ColourMap& map);

  /// The value of the isosurface that is shown; nothing: none is.
  std::optional<double> iso() const { return iso_; }
  /// Of its volume; empty: not known.
  scene::ValueSpan iso_range() const { return iso_range_; }
  /// How often they are in it; empty: not known.
  std::vector<HistogramBar> iso_bars() const;
  void choose_iso(double value);

 private:
  Give give_;
  std::vector<scene::ArrayInfo> infos_;
  std::string infos_text_;  // that they came from
  std::vector<std::string> arrays_;
  std::optional<scene::Colouring> colouring_;
  struct Wish {
    double lo, hi, since_s;
  };
  std::optional<Wish> wished_;
  std::optional<double> iso_;
  scene::ValueSpan iso_range_;
  std::optional<volume::Histogram> histogram_;  // of the isosurface's volume
};

}  // namespace telesplat::viewer
