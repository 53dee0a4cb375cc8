// Contents of a window's panel and a person's actions in it, without any window system, OpenGL or sockets: figures come
// in, wishes and orders go out.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/panel/session_status.h"
#include "client/viewer/display/frame_figures.h"
#include "client/viewer/input/look.h"
#include "common/scene/kind.h"

namespace telesplat::viewer {

/// Values in order of arrival, each with its time; values older than the span are dropped. Used by one thread.
class History {
 public:
  static constexpr size_t kMost = 4096;  ///< values; beyond it the oldest in the span are dropped

  explicit History(double span_s) : span_s_(span_s) {}

  /// A value that is not finite is ignored. A time before the newest one begins the history anew.
  void add(double t_s, double value);
  bool empty() const { return samples_.empty(); }
  /// Returns the newest value, or 0 before the first.
  double newest() const { return samples_.empty() ? 0 : samples_.back().value; }
  double span_s() const { return span_s_; }

  /// Divides the span before `now_s` into `count` columns, the oldest first. Each is its largest value, so that a
  /// single peak shows; an empty column repeats the one before; NaN before the first value.
  std::vector<float> columns(double now_s, size_t count) const;

 private:
  struct Sample {
    double t_s, value;
  };
  double span_s_;
  std::deque<Sample> samples_;
};

/// Plots of figures after frames. Used by one thread, the display's.
class FigurePlots {
 public:
  static constexpr double kSpan_s = 20;  ///< width of the plots
  struct Plot {
    std::string name, unit;
    History history;
    uint32_t colour;  ///< 0x00RRGGBB, of Okabe and Ito's palette, which colour-blind people tell apart
    int digits;       ///< digits after the point
    double floor;     ///< least value of the plot's top
  };

  FigurePlots();
  void add(const FrameFigures& figures);
  /// The figures that were added last.
  const FrameFigures& newest() const { return newest_; }
  double frames_a_second() const { return frames_a_second_; }
  const std::vector<Plot>& plots() const { return plots_; }

 private:
  void count_rates(const FrameFigures& figures);

  FrameFigures newest_, rated_;  // rated_: at the last count of rates
  double frames_a_second_ = 0;
  std::vector<Plot> plots_;
};

/// Used by one thread, the display's.
class Panel {
 public:
  struct Setup {
    bool transparent = false;  ///< the person cannot choose the background
    std::string viewer;        ///< this viewer's name, for orders to this viewer only
    bool shown = false;
    bool opens = false;  ///< other data sets can be opened here
  };
  explicit Panel(Setup setup);

  static constexpr double kGrace_s = 3;  ///< time that a service may be missing without a message
  static constexpr double kTold_s = 6;   ///< time that the newest message is shown outside the panel too
  static constexpr size_t kMostMessages = 100;

  struct Message {
    double t_s = 0;
    std::string text;
    bool problem = false;
  };

  /// State of camera paths.
  struct PathState {
    bool records = false, plays = false, can_play = false;
    double recorded_s = 0;
  };

  // ---- facts ----
  void on_path(const PathState& path) { path_ = path; }
  /// The present work of the session's processes, such as reading; empty: they are idle.
  void on_progress(const std::string& progress) { progress_ = progress; }
  void on_figures(const FrameFigures& figures);
  /// The session shows a scene of this kind.
  void on_scene(scene::Pipeline pipeline) { pipeline_ = pipeline; }
  void on_kind(std::optional<scene::Kind> kind) { kind_ = kind; }
  /// The window's settings as texts, by their orders (scene::settings()).
  void on_values(std::map<std::string, std::string> values) { values_ = std::move(values); }
  void on_answer(double now_s, const OrderAnswer& answer);
  /// Nothing: the master did not answer; then `problem` has the reason.
  void on_status(double now_s, const std::optional<SessionStatus>& status, const std::string& problem);
  void tell(double now_s, std::string text, bool problem = false);

  bool shown() const { return shown_; }
  void show(bool shown) { shown_ = shown; }
  const std::string& progress() const { return progress_; }
  const PathState& path() const { return path_; }
  const FrameFigures& figures() const { return plots_.newest(); }
  const FigurePlots& plots() const { return plots_; }
  scene::Pipeline pipeline() const { return pipeline_; }
  std::optional<scene::Kind> kind() const { return kind_; }
  const Setup& setup() const { return setup_; }
  /// Empty: the value is not known.
  std::string value(const std::string& order) const;
  /// The coupling in force, or one that was ordered and is not in force yet.
  const CouplingState& coupling() const { return wished_coupling_ ? *wished_coupling_ : figures().frame.coupling; }
  bool coupling_pending() const { return wished_coupling_.has_value(); }
  const std::optional<SessionStatus>& status() const { return status_; }
  /// The oldest message comes first.
  const std::deque<Message>& messages() const { return messages_; }
  /// Lines for a person while the panel is hidden: progress, else missing services, else the newest message if it is at
  /// most kTold_s old.
  std::vector<std::string> news(double now_s) const;

  // ---- the person ----
  /// Chooses a value, as an order of `telesplat ctl` to this window would.
  void choose(const std::string& order, const std::string& value);
  void choose_coupling(const CouplingState& coupling);
  /// Acts as if the person pressed this key.
  void press(Key key) { pressed_.push_back(key); }
  /// Wishes to see the data from this side.
  void choose_side(const Side& side) { side_ = side; }
  void choose_picture(const PictureWish& wish) { wished_picture_ = wish; }
  void order(Order order) { orders_.push_back(std::move(order)); }

  // ---- results, once each ----
  std::vector<std::pair<std::string, std::string>> take_chosen() { return std::exchange(chosen_, {}); }
  std::optional<Side> take_side() { return std::exchange(side_, std::nullopt); }
  std::vector<Key> take_pressed() { return std::exchange(pressed_, {}); }
  std::optional<PictureWish> take_picture() { return std::exchange(wished_picture_, std::nullopt); }
  std::vector<Order> take_orders() { return std::exchange(orders_, {}); }

 private:
  Setup setup_;
  bool shown_;
  scene::Pipeline pipeline_ = scene::Pipeline::kPoints;
  std::optional<scene::Kind> kind_;
  FigurePlots plots_;
  std::optional<CouplingState> wished_coupling_;
  std::map<std::string, std::string> values_;
  std::vector<std::pair<std::string, std::string>> chosen_;
  std::vector<Order> orders_;
  std::vector<Key> pressed_;
  std::optional<Side> side_;
  std::optional<PictureWish> wished_picture_;
  PathState path_;
  std::string progress_;
  std::optional<SessionStatus> status_;
  std::vector<std::string> missing_;
  double missing_since_s_ = 0;  // since when the status lacks a service; 0: all are there
  std::deque<Message> messages_;
};

}  // namespace telesplat::viewer
