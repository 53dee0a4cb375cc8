// What a person can change of a session's scene: its colours, what is cut away, a volume's transfer function and step,
// a Julia set's parameters and timeline. Orders come out, as `telesplat ctl` gives them. No window, no OpenGL, no
// sockets.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/window/panel/session_status.h"
#include "client/displays/window/panel/transfer_editor.h"
#include "common/julia/parameters.h"
#include "common/julia/timeline.h"
#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// What a person cuts away of the data: a box along the data's axes that sliders move, or any order of `telesplat ctl
/// clip`. One thread.
class CutControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;  ///< what was set is shown until the session has it, so long

  explicit CutControls(Give give) : give_(std::move(give)) {}

  void on_session(double now_s, const wire::Welcome& session);
  void on_refusal() { wished_.reset(); }

  /// The order in force, or the one that was given and is not yet; empty: nothing is cut away.
  const std::string& order() const { return wished_ ? wished_->order : order_; }
  /// Whether the data server told the box that sliders move in.
  bool knows_box() const { return !placement_.box_data.empty(); }
  std::string unit() const { return placement_.unit; }

  /// What is kept along an axis, per cent of the data's box.
  struct Kept {
    double from = 0, to = 100;
    bool operator==(const Kept&) const = default;
  };
  /// As far as the order is of planes across the axes.
  std::array<Kept, 3> kept() const;
  /// The same in the data's own coordinates.
  double value(int axis, double percent) const;
  /// At least a hundredth of the box is kept.
  void keep(double now_s, int axis, Kept kept);
  /// Takes any order. Error: it is not valid.
  Status give(double now_s, const std::string& order);

 private:
  Give give_;
  scene::Placement placement_;
  std::string order_;
  struct Wish {
    std::string order;
    double since_s;
  };
  std::optional<Wish> wished_;
};

/// What a person can change of a mesh's colours: the array, its range, the map; and the value of an isosurface. One
/// thread.
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
  /// Returns the range of the colouring in force, or the range that was ordered and has not come yet.
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
  /// Returns the values of the isosurface's volume; empty: not known.
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

/// One thread.
class SceneControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;    ///< a value that was set is shown until the session has it, so long
  static constexpr double kLongest_s = 3600;  ///< of a timeline

  explicit SceneControls(Give give) : give_(std::move(give)), colours_(give_), cut_(give_) {}

  // ---- facts ----
  void on_session(double now_s, const wire::Welcome& session);
  /// The timeline that plays, as the master tells it; empty: none.
  void on_animation(const std::string& timeline) { playing_ = timeline; }
  void on_answer(const OrderAnswer& answer);

  std::optional<scene::Kind> kind() const { return kind_; }
  const std::string& playing() const { return playing_; }

  ColourControls& colours() { return colours_; }
  CutControls& cut() { return cut_; }

  // ---- volumes ----
  const TransferEditor& transfer() const { return transfer_; }
  /// Takes what `change` does to the editor to the session, if it changes the function.
  void edit(const std::function<bool(TransferEditor&)>& change);
  void choose_preset(std::string_view name);
  /// "" if it was written, else why not.
  Status save_transfer(const std::string& path) const { return transfer_.save(path, "telesplat"); }
  const std::optional<volume::Session>& volume() const { return volume_; }
  void choose_step(double now_s, int step);
  void choose_speed(double now_s, double steps_a_second);
  void play_series(bool plays);

  // ---- Julia sets ----
  /// As it is, or was set and is not yet.
  double value(std::string_view name) const;
  /// Of parameter_infos() that may change. A whole one is rounded.
  void set(double now_s, const julia::ParameterInfo& info, double value);
  /// The timeline that the person makes; play() makes it the session's.
  const julia::Timeline& timeline() const { return timeline_; }
  double timeline_s() const;
  /// A key frame of a parameter that is not whole, in place of one at the same time (to 0.05 s). The first one of a
  /// track brings one at 0 s with it.
  void add_key(const julia::ParameterInfo& info, double t_s, double value);
  void remove_key(size_t track, size_t key);
  void clear_timeline() { timeline_ = {}; }
  void play();
  void stop();

 private:
  void wish(double now_s, const std::string& name, double value);

  Give give_;
  ColourControls colours_;
  CutControls cut_;
  std::optional<scene::Kind> kind_;
  TransferEditor transfer_;
  std::optional<volume::Session> volume_;
  std::map<std::string, double> told_;
  struct Wish {
    double value = 0, since_s = 0;
  };
  std::map<std::string, Wish> wishes_;
  julia::Timeline timeline_;
  std::string playing_;
};

}  // namespace telesplat::viewer
