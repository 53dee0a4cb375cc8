// What a person can change of a session's scene: its colours, what is cut away, a volume's transfer function and step,
// a Julia set's parameters and timeline. Orders come out, as `telesplat ctl` gives them. No window, no OpenGL, no
// sockets.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/displays/window/panel/order.h"
#include "client/displays/window/panel/scene/colour_controls.h"
#include "client/displays/window/panel/scene/cut_controls.h"
#include "client/displays/window/panel/transfer_editor.h"
#include "common/julia/parameters.h"
#include "common/julia/timeline.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

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
