#include "client/displays/window/window_surface.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <utility>

#include "client/displays/window/open_window.h"
#include "client/displays/window/screenshots.h"
#include "common/core/clock.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kShowAgain_s = 0.1;
constexpr size_t kMostPicture_pixels = 100'000'000;

// Returns the movement that plays from the beginning. An orbit is fitted later, when its centre is known.
std::optional<geometry::Trajectory> first_movement(const HeadMovement& movement) {
  if (movement.recorded) return *movement.recorded;
  return movement.orbits ? std::optional(geometry::Trajectory::orbit()) : std::nullopt;
}

// Prints the request for the launcher.
void ask_to_open(const std::string& path) {
  if (path.find('\n') != path.npos) return;
  std::printf("open %s\n", path.c_str());
  std::fflush(stdout);
}

}  // namespace

// Collects lines for the person; screenshots send theirs from another thread.
struct WindowSurface::Lines {
  std::mutex mutex;
  std::function<void(const std::string&)> tell;  // never from two threads at once
  std::vector<std::string> for_panel;
  explicit Lines(std::function<void(const std::string&)> to) : tell(std::move(to)) {}
  void add(const std::string& line, bool to_panel = true) {
    const std::lock_guard lock(mutex);
    tell(line);
    if (to_panel) for_panel.push_back(line);
  }
};

Result<std::unique_ptr<WindowSurface>> WindowSurface::open(const ViewerOptions& o, const DisplayHelp& help) {
  auto window = Window::open({o.display.width, o.display.height, o.window.fullscreen, "Telesplat",
                              o.display.stereo.mode == stereo::Mode::kQuadBuffer});
  if (!window) return window.error();
  return std::unique_ptr<WindowSurface>(new WindowSurface(o, help, std::move(*window)));
}

WindowSurface::WindowSurface(const ViewerOptions& o, const DisplayHelp& help, std::unique_ptr<Window> window)
    : options_(o),
      chosen_(o, options_.display),
      window_(std::move(window)),
      interaction_(first_movement(o.head.movement), first_look(o.display.render, o.display.shading)),
      poses_(help.poses),
      lines_(std::make_shared<Lines>(help.tell)),
      notes_([lines = lines_](const std::string& line) { lines->add(line); }),
      panel_({.transparent = o.display.transparent,
              .viewer = o.service.name,
              .shown = o.window.panel,
              .opens = o.window.launched}),
      opening_(o.window.launched ? ask_to_open : nullptr, o.window.launched ? STDIN_FILENO : -1, interaction_, panel_,
               scene_controls_, [this](const std::string& line) { tell(line); }),
      orders_(o.service.master, help.asking),
      screenshots_(o.record.out.empty() ? "." : o.record.out + "/images",
                   [lines = lines_](const std::string& line) { lines->add(line); }) {
  interaction_.open().panel = o.window.panel;
  interaction_.open().allow(o.window.launched, has_scene());
  interaction_.show_dialog(o.window.begins_empty);
  interaction_.set_key_names([this](Key key) { return window_->key_name(key); });
  tell(first_keys());
  if (poses_) interaction_.set_tracked([this](double now_s) { return poses_->begin_frame(now_s); });
}

void WindowSurface::tell(const std::string& line) { lines_->add(line); }

WindowSurface::~WindowSurface() {
  interaction_.end_path();
  keep_path();
}

void WindowSurface::on_scene(const ShownScene& scene) {
  views_.on_scene(scene);
  panel_.on_scene(scene.pipeline);
}

geometry::Camera WindowSurface::begin_frame(double now_s, double t_s, Look& look) {
  window_->poll(interaction_);
  if (interaction_.take(Wish::kFullscreen)) window_->toggle_fullscreen();
  views_.fit();
  for (const auto& side : {interaction_.take_side_wish(), panel_.take_side()})
    if (side) views_.look_from(*side, hands_.terms());
  const geometry::Camera camera = camera_of(interaction_.advance(now_s, options_.display.span.moves(t_s)));
  interaction_.set_height_tangent(camera.top - camera.bottom);
  opening_.take_launcher_lines(now_s, has_scene(), views_.has_scene());
  opening_.take_dropped(*window_);
  run_panel(now_s, look);
  follow_bookmarks();
  if (interaction_.take(Wish::kOverlays)) hands_.toggle_all();
  if (auto picture = hands_.update(now_s, camera, views_.scene().box_room))
    overlays_.show("hands", {std::move(*picture), Overlay::Corner::kLowerLeft});
  measuring_.show_marks(camera, options_.display.stereo.mode == stereo::Mode::kOff);  // two eyes would need two
  // The panel has its own list of keys beside it.
  const bool help = interaction_.open().help && !panel_.shown();
  gui_.show_help(help ? key_lines() : std::vector<std::string>(), width(), height());
  gui_.show_news(now_s, std::max(1, int(std::lround(2 * window_->content_scale()))));
  keep_path();
  return camera;
}

// Sends the panel's orders and takes their answers, without waiting.
void WindowSurface::run_panel(double now_s, Look& look) {
  panel_.show(interaction_.open().panel);
  for (const Key key : panel_.take_pressed()) interaction_.press(key);
  for (const auto& [name, value] : panel_.take_chosen()) choose(now_s, name, value);
  look = interaction_.look();
  if (panel_.shown()) panel_.on_values(values());
  panel_.on_path({.records = interaction_.path().records(),
                  .plays = interaction_.playing(),
                  .can_play = interaction_.can_play(),
                  .recorded_s = interaction_.path().length_s()});
  std::vector<std::string> lines;
  {
    const std::lock_guard lock(lines_->mutex);
    lines.swap(lines_->for_panel);
  }
  for (auto& line : lines) panel_.tell(now_s, std::move(line));
  orders_.watch(panel_.shown() || !views_.has_scene() || panel_.figures().waits_s > 0);
  for (auto& order : panel_.take_orders()) orders_.give(std::move(order));
  for (auto& probe : measuring_.places().take_probes()) orders_.give({PanelOrders::kProbe, std::move(probe), {}});
  for (const auto& answer : orders_.take_answers(now_s, interaction_.undo())) {
    if (answer.order.command == PanelOrders::kProbe) {
      const std::string line = measuring_.places().on_answer(answer.order.arguments, answer.obeyed, answer.text);
      if (!line.empty()) tell(line);
      continue;
    }
    panel_.on_answer(now_s, answer);
    scene_controls_.on_answer(answer);
  }
  const auto news = orders_.take_news();
  if (!news) return;
  panel_.on_status(now_s, news->status, news->problem);
  if (news->status) scene_controls_.on_animation(news->status->animation);
}

std::vector<std::string> WindowSurface::key_lines() const {
  return key_help([this](Key key) { return window_->key_name(key); });
}

// Prints lines that keys led to, and writes a path that is complete.
void WindowSurface::keep_path() {
  if (poses_)
    if (const auto news = poses_->take_news(monotonic_s())) tell(*news);
  const auto notes = interaction_.take_notes();
  const auto help = notes.empty() ? std::vector<std::string>() : key_lines();
  for (const auto& note : notes) lines_->add(note, std::find(help.begin(), help.end(), note) == help.end());
  const auto path = interaction_.path().take();
  if (path.empty()) return;
  const std::string name = new_file(path_folder(), "path", ".csv");
  const Status written = geometry::write_trajectory(name, path);
  tell(written
           ? fmt::format("the camera's path of {:.1f} s: {} (T plays it, --trajectory takes it)", path.back().t_s, name)
           : written.error().text);
}

// Shows an unchanged frame every kShowAgain_s, too: a window system may need it again without a notice.
void WindowSurface::present(const image::View& view, bool changed) {
  const PresentedWindow now{monotonic_s(), window_->width(), window_->height(), overlays_.version(),
                            panel_.shown() || opening_.shows_dialog() || legend_.built()};
  if (!changed && now.like(shown_) && !(now.gui && window_->gui_due(now.at_s)) && now.at_s - shown_.at_s < kShowAgain_s)
    return;
  shown_ = now;
  if (now.gui)
    window_->present(view, overlays_, [&] { return build_panel(now.at_s); });
  else {
    const LoggedBuild nothing(gui_.log());
    window_->present(view, overlays_);
  }
  if (poses_) poses_->presented(monotonic_s());
}

ViewSettings WindowSurface::settings() const {
  return chosen_.get(interaction_.look(), panel_.pipeline() == scene::Pipeline::kPictures);
}

std::map<std::string, std::string> WindowSurface::values() const {
  auto out = values_of(settings());
  out.merge(hands_.values());
  out["fullscreen"] = window_->fullscreen() ? "on" : "off";
  const geometry::Box& box = views_.scene().box_room;
  const glm::vec3 room = box.hi - box.lo;
  if (views_.has_scene()) out["room-size"] = fmt::format("{:.4g} m", std::max({room.x, room.y, room.z}));
  if (const auto* terms = hands_.terms()) out["z-scale"] = fmt::format("{:.4g}", terms->placement.coordinates.shown.z);
  if (const auto& volume = scene_controls_.volume()) out["lighting"] = volume->lit ? "on" : "off";
  return out;
}

Status WindowSurface::set(const std::string& name, const std::string& value) {
  const auto on = read_switch(value);
  const bool panel = name == "panel", fullscreen = name == "fullscreen";
  if (panel || fullscreen || hands_.values().contains(name) || name == "all") {
    if (!on) return on.error();
    if (panel) interaction_.open().panel = *on;
    if (fullscreen && *on != window_->fullscreen()) window_->toggle_fullscreen();
    return panel || fullscreen ? ok_status() : hands_.show(name, *on);
  }
  ViewSettings changed = settings();
  if (const Status s = change(changed, name, value); !s) return s;
  if (chosen_.changes_eyes(changed)) {
    if (!options_.record.out.empty()) return Error{"a run that is recorded keeps the two eyes that it began with"};
    views_.refit();
  }
  interaction_.set_look(changed.look);
  const bool legend = options_.display.legend != changed.legend;
  chosen_.set(changed);
  if (legend) legend_.show();
  return ok_status();
}

// Sets a setting for the person, who can undo it. Calls of set() from elsewhere are other people's.
void WindowSurface::choose(double now_s, const std::string& name, const std::string& value) {
  const std::string before = values()[name];
  if (const Status s = set(name, value); !s) return panel_.tell(now_s, name + ": " + s.error().text, true);
  if (values()[name] == before) return;
  const auto becomes = [this, name](const std::string& text) {
    return [this, name, text] {
      if (const Status s = set(name, text); !s) tell(name + ": " + s.error().text);
    };
  };
  interaction_.undo().did(now_s, {name, becomes(before), becomes(value), name});
}

// Builds panel, legend and dialogs. Returns the width that the panel covers at the left.
double WindowSurface::build_panel(double now_s) {
  const LoggedBuild logged(gui_.log());
  const auto more = [&] {
    show_measurements(measuring_.places(), [this] { measuring_.save(path_folder()); });
    notes_.build(!measuring_.places().empty(), now_s);
  };
  const double width = gui_.build(
      now_s, [this] { save_transfer(); }, more);
  if (const auto* terms = hands_.terms(); terms && panel_.shown())
    notes_.follow(*terms, interaction_.pose(), measuring_.places());
  legend_.not_built();
  if (legend_.built()) legend_.build(scene_controls_.colours(), now_s, width);
  if (panel_.shown() && interaction_.open().help) show_keys(key_lines());
  opening_.build(has_scene());
  return width;
}

void WindowSurface::on_session(const std::shared_ptr<const wire::Welcome>& session) {
  if (!session) return;
  scene_controls_.on_session(monotonic_s(), *session);
  panel_.on_kind(scene_controls_.kind());
  orders_.on_session(session);
  if (views_.on_session(scene::SessionView(*session))) {
    measuring_.clear();
    notes_.clear();
  }
  chosen_.follow(session->settings);
}

void WindowSurface::save_transfer() {
  const std::string name = new_file(path_folder(), "transfer", ".json");
  const Status saved = scene_controls_.save_transfer(name);
  tell(saved ? "transfer function: " + name : saved.error().text);
}

void WindowSurface::take_picture(const image::View& view, image::Alpha alpha) {
  if (!interaction_.take(Wish::kScreenshot)) return;
  image::View copy{view.width, view.height, view.colour, {}};
  legend_.draw_into(copy, options_.display.wall);
  screenshots_.take(copy, alpha);
}

// Sets the camera of this view in the wished size: the field of view spans its longer side. On a wall it shows this
// screen's part, in its full width; with two eyes, the view of the head between them.
std::optional<PictureWish> WindowSurface::take_picture_wish(geometry::Camera& camera) {
  const auto wish = panel_.take_picture();
  if (!wish || !wish->own_size()) return wish;
  if (size_t(wish->width) * size_t(wish->height) > kMostPicture_pixels) {
    tell(fmt::format("a picture of {} x {} has more than {} million pixels", wish->width, wish->height,
                     kMostPicture_pixels / 1'000'000));
    return std::nullopt;
  }
  const auto& o = options_.display;
  if (o.wall.tiles() == 1 && !o.wall.described) {
    camera = window_camera(camera.pose, o.fov_deg, wish->width, wish->height, o.near_m);
    return wish;
  }
  const double middle = 0.5 * (camera.bottom + camera.top),
               half = 0.5 * (camera.right - camera.left) * wish->height / wish->width;
  camera.bottom = middle - half, camera.top = middle + half;
  camera.width = wish->width, camera.height = wish->height;
  return wish;
}

void WindowSurface::take_wished_picture(const PictureWish& wish, image::View picture, image::Alpha alpha) {
  legend_.draw_into(picture, {});
  screenshots_.take(picture, alpha, wish.exr);
}

void WindowSurface::follow_bookmarks() {
  const bool keeps = interaction_.take(Wish::kBookmark), next = interaction_.take(Wish::kNextBookmark);
  const SceneTerms* terms = hands_.terms();
  if (keeps && terms) notes_.keep(*terms, interaction_.pose());
  if (next && terms) notes_.next(*terms);
  if (const auto found = notes_.take_found()) interaction_.go_to(found->pose);
}

void WindowSurface::report(const FrameFigures& figures) {
  panel_.on_figures(figures);
  if (const bool waits = figures.waits_s > 0; waits != overlays_.shows("waiting"))
    overlays_.show("waiting",
                   {waits ? text_panel({"waiting for a view update"}, 2) : image::View(), Overlay::Corner::kUpperLeft});
  hands_.on_frame(figures.now_s, figures.frames);
  if (const auto title = title_.update(figures, interaction_.path())) window_->set_title(*title);
}

// A window may get another size than it asked for: the options follow.
Result<std::unique_ptr<DisplaySurface>> open_window(ViewerOptions& o, const DisplayHelp& help) {
  auto opened = WindowSurface::open(o, help);
  if (!opened) return opened.error();
  o.display.width = (*opened)->width();
  o.display.height = (*opened)->height();
  if (const auto& panel = o.display.stereo.panel;
      panel && (panel->width != o.display.width || panel->height != o.display.height))
    help.tell(
        fmt::format("the window has {}x{} pixels and the autostereo display of --barrier {}x{}: it must fill that "
                    "display pixel by pixel (--fullscreen)",
                    o.display.width, o.display.height, panel->width, panel->height));
  return std::unique_ptr<DisplaySurface>(std::move(*opened));
}

}  // namespace telesplat::viewer
