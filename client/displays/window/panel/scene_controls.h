// A person's controls of a session's scene: its colours, its clip, a volume's transfer function and step, a Julia set's
// parameters and timeline. They give orders as `telesplat ctl` does. No window, no OpenGL, no sockets.
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

/// A person's clip of the data: a box along the data's axes that sliders move, or any order of `telesplat ctl clip`.
/// Used by one thread.
class CutControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;  ///< how long a wish is shown while the session does not have it

  explicit CutControls(Give give) : give_(std::move(give)) {}

  void on_session(double now_s, const wire::Welcome& session);
  void on_refusal() { wished_.reset(); }

  /// The order in force, or one that was given and is not in force yet; empty: the data are not clipped.
  const std::string& order() const { return wished_ ? wished_->order : order_; }
  /// True if the data server sent the box in which sliders move.
  bool knows_box() const { return !placement_.box_data.empty(); }
  std::string unit() const { return placement_.unit; }

  /// The part that is kept along an axis, per cent of the data's box.
  struct Kept {
    double from = 0, to = 100;
    bool operator==(const Kept&) const = default;
  };
  /// Reads the kept parts from the order's planes; planes that are not across an axis are ignored.
  std::array<Kept, 3> kept() const;
  /// Converts per cent to the data's own coordinates.
  double value(int axis, double percent) const;
  /// Gives the order. At least a hundredth of the box is kept.
  void keep(double now_s, int axis, Kept kept);
  /// Gives any order. Error: it is not valid.
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

/// A person's controls of a mesh's colours: the array, its range, the map; and of an isosurface's value. Used by one
/// thread.
class ColourControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;  ///< how long a chosen range is shown while the session does not have it

  explicit ColourControls(Give give) : give_(std::move(give)) {}

  void on_session(double now_s, const wire::Welcome& session);
  void on_refusal() { wished_.reset(); }

  /// Names of arrays that can colour the mesh, and of components of vectors; empty: there are no arrays.
  const std::vector<std::string>& arrays() const { return arrays_; }
  /// Nothing: the mesh has its own colours.
  const std::optional<scene::Colouring>& colouring() const { return colouring_; }
  /// Returns the range of the colouring in force, or one that was ordered and is not in force yet.
  std::pair<double, double> range() const;
  /// Range of all values of its array; empty: not known.
  scene::ValueSpan whole_range() const;

  /// Colours by this array, over its whole range, in the present map. scene::kNoArray: the file's own colours.
  void choose_array(const std::string& name);
  /// Does nothing unless lo is below hi.
  void choose_range(double now_s, double lo, double hi);
  void reset_range();
  void choose_map(const colour::ColourMap& map);

  /// Value of the isosurface on display; nothing: the scene has no isosurface.
  std::optional<double> iso() const { return iso_; }
  /// Range of values in the isosurface's volume; empty: not known.
  scene::ValueSpan iso_range() const { return iso_range_; }
  /// Histogram of these values; empty: not known.
  std::vector<HistogramBar> iso_bars() const;
  void choose_iso(double value);

 private:
  Give give_;
  std::vector<scene::ArrayInfo> infos_;
  std::string infos_text_;  // source of infos_
  std::vector<std::string> arrays_;
  std::optional<scene::Colouring> colouring_;
  struct Wish {
    double lo, hi, since_s;
  };
  std::optional<Wish> wished_;
  std::optional<double> iso_;
  scene::ValueSpan iso_range_;
  std::optional<volume::Histogram> histogram_;  // the isosurface's volume
};

/// Used by one thread.
class SceneControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;    ///< how long a chosen value is shown while the session does not have it
  static constexpr double kLongest_s = 3600;  ///< longest timeline

  explicit SceneControls(Give give) : give_(std::move(give)), colours_(give_), cut_(give_) {}

  // ---- facts ----
  void on_session(double now_s, const wire::Welcome& session);
  /// Takes the timeline that plays, from the master; empty: no timeline plays.
  void on_animation(const std::string& timeline) { playing_ = timeline; }
  void on_answer(const OrderAnswer& answer);

  std::optional<scene::Kind> kind() const { return kind_; }
  const std::string& playing() const { return playing_; }

  ColourControls& colours() { return colours_; }
  CutControls& cut() { return cut_; }

  // ---- volumes ----
  const TransferEditor& transfer() const { return transfer_; }
  /// Lets `change` edit the function, and orders the result if it differs.
  void edit(const std::function<bool(TransferEditor&)>& change);
  void choose_preset(std::string_view name);
  /// Error: why it could not be written.
  Status save_transfer(const std::string& path) const { return transfer_.save(path, "telesplat"); }
  const std::optional<volume::Session>& volume() const { return volume_; }
  void choose_step(double now_s, int step);
  void choose_speed(double now_s, double steps_a_second);
  void play_series(bool plays);

  // ---- Julia sets ----
  /// The value in force, or one that was chosen and is not in force yet.
  double value(std::string_view name) const;
  /// Sets a parameter of parameter_infos() that may change. Whole ones are rounded.
  void set(double now_s, const julia::ParameterInfo& info, double value);
  /// The timeline that the person edits; play() gives it to the session.
  const julia::Timeline& timeline() const { return timeline_; }
  double timeline_s() const;
  /// Adds a key frame of a parameter that is not whole; replaces one at the same time (within 0.05 s). The first one of
  /// a track also adds one at 0 s.
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
