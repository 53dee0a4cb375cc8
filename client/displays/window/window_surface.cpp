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
#include "common/core/within.h"
#include "common/geometry/fit.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kShowAgain_s = 0.1;
constexpr double kSteps = 32;         // the legend's share of the window's width counts in such steps
constexpr double kMostCovered = 0.6;  // share of the window's width that may be covered; else the first view uses all
constexpr size_t kMostPicture_pixels = 100'000'000;

// Returns the movement that plays from the beginning. An orbit is fitted later, when its centre is known.
std::optional<geometry::Trajectory> first_movement(const HeadMovement& movement) {
  if (movement.recorded) return *movement.recorded;
  return movement.orbits ? std::optional(geometry::Trajectory::orbit()) : std::nullopt;
}

// Returns the largest scale at which the keys fit into the window.
int help_scale(const std::vector<std::string>& lines, int width, int height) {
  const image::View smallest = text_panel(lines, 1);
  return within(std::min(width / (smallest.width + 12), height / (2 * smallest.height)), 1, 4);
}

// Prints the request for the launcher.
void ask_to_open(const std::string& path) {
  if (path.find('\n') != path.npos) return;
  std::printf("open %s\n", path.c_str());
  std::fflush(stdout);
}

}  // namespace

geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m) {
  geometry::Camera camera = geometry::make_camera(pose, fov_deg, width, height, near_m);
  if (height <= width) return camera;
  const double narrow = double(width) / double(height);
  camera.left *= narrow, camera.right *= narrow, camera.bottom *= narrow, camera.top *= narrow;
  return camera;
}

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
      poses_(help.poses),
      sampling_{o.requests.adaptive, o.requests.sampling_width, o.requests.sampling_height,
                o.least_sampling.value_or(o.requests.min_scale)},
      sampling_chosen_(o.least_sampling.has_value()),
      window_(std::move(window)),
      interaction_(first_movement(o.head.movement), first_look(o.display.render, o.display.shading)),
      lines_(std::make_shared<Lines>(help.tell)),
      bookmarks_([lines = lines_](const std::string& line) { lines->add(line); }),
      panel_({.transparent = o.display.transparent,
              .viewer = o.service.name,
              .shown = o.panel,
              .opens = o.window.launched}),
      opening_(o.window.launched ? ask_to_open : nullptr, o.window.launched ? STDIN_FILENO : -1, interaction_, panel_,
               scene_controls_, [this](const std::string& line) { tell(line); }),
      desk_(std::make_unique<ControlDesk>(o.service.master, help.asking)),
      screenshots_(o.record.out.empty() ? "." : o.record.out + "/images",
                   [lines = lines_](const std::string& line) { lines->add(line); }) {
  quad_buffers_ = o.display.stereo.mode == stereo::Mode::kQuadBuffer;
  interaction_.open().panel = o.panel;
  interaction_.open().allow(o.window.launched, has_scene());
  interaction_.show_dialog(o.window.begins_empty);
  interaction_.set_key_names([this](Key key) { return window_->key_name(key); });
  tell(first_keys());
  if (poses_)
    interaction_.set_tracked([this](double now_s) {
      tracked_ = true;
      return poses_->begin_frame(now_s);
    });
}

void WindowSurface::tell(const std::string& line) { lines_->add(line); }

WindowSurface::~WindowSurface() {
  interaction_.end_path();
  keep_path();
}

// Returns the camera of all tiles of a wall.
geometry::Camera WindowSurface::whole(const geometry::Pose& pose) const {
  const auto& o = options_.display;
  if (o.wall.described) return wall::fitting_frustum(*o.wall.described, o.near_m);
  const stereo::Size eye = o.stereo.eye_size(window_->width(), window_->height());
  return window_camera(pose, o.fov_deg, eye.width * o.wall.columns, eye.height * o.wall.rows, o.near_m);
}

void WindowSurface::on_scene(const ShownScene& scene) {
  scene_ = scene;
  panel_.on_scene(scene.pipeline);
  fitted_ = {};
}

// Returns the part that panel and legend leave free. Walls and two eyes use the whole window.
WindowSurface::FreePart WindowSurface::free_part() const {
  const auto& o = options_.display;
  FreePart out{whole({}), 0};
  if (o.wall.described || o.wall.tiles() > 1 || o.stereo.on()) return out;
  const double left = double(window_->hidden()) / window_->width();
  // A legend that was dragged to the left is ignored. Its width counts in steps, since it changes with its numbers.
  const bool at_right = legend_.built() && legend_.part().left > 0.5;
  const double right = at_right ? std::ceil((1 - legend_.part().left) * kSteps) / kSteps : 0;
  if (!(left + right <= kMostCovered)) return out;
  geometry::Camera& c = out.frustum;
  out.middle_x = (left - right) * (c.right - c.left) / 2;
  for (double* side : {&c.left, &c.right}) *side *= 1 - left - right;
  return out;
}

// Fits the first view to the window; the camera follows it until the person takes it.
void WindowSurface::fit_views() {
  if (scene_.box_room.empty()) return;
  const FreePart part = free_part();
  const auto& f = part.frustum;
  const std::array<double, 4> now{f.right, f.top, part.middle_x, double(window_->width())};
  if (now == fitted_) return;
  fitted_ = now;
  const auto& movement = options_.head.movement;
  const double middle_x = movement.eye ? 0 : part.middle_x;
  interaction_.set_scene(scene_.pipeline, scene_.box_room, movement.first_view(scene_.box_room, f, middle_x), middle_x);
  if (movement.orbits) interaction_.set_recorded(movement.trajectory(scene_.box_room, whole({})));
}

// Looks along an axis of the data, from its positive or its negative end.
void WindowSurface::look_from(const Side& side) {
  if (scene_.box_room.empty()) return;
  glm::dvec3 back(0.0);
  back[side.axis] = side.negative ? -1 : 1;
  if (terms_) back = glm::normalize(glm::dmat3(terms_->placement.data_to_room) * back);
  const FreePart part = free_part();
  interaction_.travel(geometry::fitted_view_from(back, scene_.box_room, part.frustum, part.middle_x),
                      "view from " + side_name(side));
}

geometry::Camera WindowSurface::begin_frame(double now_s, double t_s, Look& look) {
  window_->poll(interaction_);
  if (interaction_.take(Wish::kFullscreen)) window_->toggle_fullscreen();
  fit_views();
  for (const auto& side : {interaction_.take_side_wish(), panel_.take_side()})
    if (side) look_from(*side);
  const auto& o = options_.display;
  const bool playback = o.span.moves(t_s);
  tracked_ = false;
  head_ = interaction_.advance(now_s, playback);
  const geometry::Camera camera = camera_of(head_);
  interaction_.set_height_tangent(camera.top - camera.bottom);
  opening_.take_launcher_lines(now_s, has_scene(), !scene_.box_room.empty());
  opening_.take_dropped(*window_);
  run_panel(now_s, look);
  follow_bookmarks(head_);
  if (interaction_.take(Wish::kOverlays)) hands_.toggle_all();
  if (auto picture = hands_.update(now_s, camera, scene_.box_room))
    overlays_.show("hands", {std::move(*picture), Overlay::Corner::kLowerLeft});
  measuring_.show_marks(camera, options_.display.stereo.mode == stereo::Mode::kOff);  // two eyes would need two
  show_help();
  show_news(now_s);
  keep_path();
  return camera;
}

// A screen's picture has the window's pixels.
geometry::Camera WindowSurface::camera_of(const geometry::Pose& head) const {
  const auto& o = options_.display;
  if (!o.wall.described) return tile_of(whole(head), o.wall);
  geometry::Camera camera = wall::screen_camera(*o.wall.described, o.wall.tile, head, o.near_m);
  const stereo::Size eye = o.stereo.eye_size(window_->width(), window_->height());
  camera.width = eye.width, camera.height = eye.height;
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
  if (!desk_) return;
  desk_->watch(panel_.shown() || scene_.box_room.empty() || panel_.figures().waits_s > 0);
  for (auto& order : panel_.take_orders()) give(std::move(order), false);
  for (auto& probe : measuring_.places().take_probes()) desk_->give({"probe", std::move(probe), {}});
  for (const auto& answer : desk_->take_answers()) {
    if (answer.order.command == "probe") {
      const std::string line = measuring_.places().on_answer(answer.order.arguments, answer.obeyed, answer.text);
      if (!line.empty()) tell(line);
      continue;
    }
    panel_.on_answer(now_s, answer);
    scene_controls_.on_answer(answer);
    if (const auto back = order_undo_.answered(answer))
      interaction_.undo().did(now_s, {answer.order.command, [this, back] { give(*back, true); },
                                      [this, order = answer.order] { give(order, true); }, answer.order.subject});
  }
  const auto news = desk_->take_news();
  if (!news) return;
  panel_.on_status(now_s, news->status, news->problem);
  if (news->status) scene_controls_.on_animation(news->status->animation);
}

void WindowSurface::give(Order order, bool undoes) {
  if (!desk_) return;
  order_undo_.given(order, undoes);
  desk_->give(std::move(order));
}

// Shows news to a person who does not see the panel.
void WindowSurface::show_news(double now_s) {
  auto news = panel_.shown() ? std::vector<std::string>() : panel_.news(now_s);
  if (news == news_) return;
  news_ = std::move(news);
  if (news_.empty()) return overlays_.hide("news");
  overlays_.show("news", {text_panel(news_, std::max(1, int(std::lround(2 * window_->content_scale())))),
                          Overlay::Corner::kUpperRight});
}

// The panel has its own list of keys beside it.
void WindowSurface::show_help() {
  const bool here = interaction_.open().help && !panel_.shown();
  const int scale = here ? help_scale(key_lines(), window_->width(), window_->height()) : 0;
  if (scale == help_scale_) return;
  help_scale_ = scale;
  overlays_.show("help", {scale > 0 ? text_panel(key_lines(), scale) : image::View(), Overlay::Corner::kUpperLeft});
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
  const Shown now{monotonic_s(), window_->width(), window_->height(), overlays_.version(),
                  panel_.shown() || opening_.shows_dialog() || legend_.built()};
  const bool same = now.width == shown_.width && now.height == shown_.height && now.overlays == shown_.overlays &&
                    now.panel == shown_.panel && !(now.panel && window_->gui_due(now.at_s));
  if (!changed && same && now.at_s - shown_.at_s < kShowAgain_s) return;
  shown_ = now;
  if (now.panel)
    window_->present(view, overlays_, [&] { return build_panel(now.at_s); });
  else {
    const LoggedBuild nothing(widget_log_);
    window_->present(view, overlays_);
  }
  if (poses_) poses_->presented(monotonic_s());
}

ViewSettings WindowSurface::settings() const {
  const auto& d = options_.display;
  return {.look = interaction_.look(),
          .transparent = d.transparent,
          .sampling = sampling_,
          .stereo = d.stereo,
          .quad_buffers = quad_buffers_,
          .legend = d.legend,
          .pictures = panel_.pipeline() == scene::Pipeline::kPictures};
}

std::map<std::string, std::string> WindowSurface::values() const {
  auto out = values_of(settings());
  out.merge(hands_.values());
  out["fullscreen"] = window_->fullscreen() ? "on" : "off";
  const glm::vec3 room = scene_.box_room.hi - scene_.box_room.lo;
  if (!scene_.box_room.empty()) out["room-size"] = fmt::format("{:.4g} m", std::max({room.x, room.y, room.z}));
  if (terms_) out["z-scale"] = fmt::format("{:.4g}", terms_->placement.coordinates.shown.z);
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
  auto& d = options_.display;
  const auto eyes = [](const StereoOptions& o) {
    return std::tuple(o.mode, o.eye_separation_m, o.screen_m, o.swap_eyes);
  };
  if (eyes(changed.stereo) != eyes(d.stereo)) {
    if (!options_.record.out.empty()) return Error{"a run that is recorded keeps the two eyes that it began with"};
    stereo_wish_ = d.stereo = changed.stereo;
    fitted_ = {};
  }
  interaction_.set_look(changed.look);
  if (changed.sampling != sampling_) {
    sampling_chosen_ = true;
    sampling_wish_ = sampling_ = changed.sampling;
  }
  if (std::exchange(d.legend, changed.legend) != changed.legend) legend_.show();
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
  const LoggedBuild logged(widget_log_);
  double width = 0;
  if (panel_.shown())
    width = show_panel(panel_, panel_view_, now_s, {[&](Panel&) {
                         show_scene(scene_controls_, scene_view_, now_s, [this] { save_transfer(); });
                         show_measurements(measuring_.places(), [this] { measuring_.save(path_folder()); });
                         const auto book = bookmarks_.book();
                         notes_wish_ = show_notes(book.get(), notes_view_, !measuring_.places().empty(), now_s);
                       }});
  if (panel_.shown()) follow_notes();
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
  order_undo_.on_session(session);
  // Another data set begins with its own first view and without measured places; the camera's owner stays.
  const scene::SessionView facts(*session);
  const std::string name =
      facts.fact("scene") + '\n' + facts.fact("data_file") + '\n' + facts.fact(scene::kPlacementFact);
  if (!facts.fact("scene").empty() && name != std::exchange(scene_name_, name) && had_scene_) {
    interaction_.back_to_first_view();
    measuring_.clear();
    notes_view_ = {};
  }
  had_scene_ = had_scene_ || !facts.fact("scene").empty();
  auto& least = sampling_.least_sampling;
  if (!sampling_chosen_) least = session->settings.least_sampling;
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

notes::Shelf WindowSurface::shelf() const {
  return notes::shelf_of(terms_->data_file, terms_->scene, notes::user_cache_folder());
}

// Carries out the panel's wishes for notes.
void WindowSurface::follow_notes() {
  const NotesWish wish = std::exchange(notes_wish_, {});
  if (!terms_) return;
  if (wish.keep) bookmarks_.keep(shelf(), head_, wish.name);
  if (!wish.go.empty()) bookmarks_.find(shelf(), wish.go);
  if (!wish.remove.empty()) bookmarks_.remove(shelf(), wish.remove);
  if (wish.remove_note > 0) bookmarks_.remove_note(shelf(), wish.remove_note);
  if (wish.look) bookmarks_.look(shelf());
  if (wish.text.empty()) return;
  notes::Note note{.text = wish.text};
  if (wish.here && !measuring_.places().empty()) {
    const scene::ToldPlace& newest = measuring_.places().rows().back().back().told;
    note.place = newest.data;
    note.value = scene::value_text(newest);
  }
  bookmarks_.add(shelf(), note);
}

void WindowSurface::follow_bookmarks(const geometry::Pose& pose) {
  const bool keeps = interaction_.take(Wish::kBookmark), next = interaction_.take(Wish::kNextBookmark);
  if (keeps && terms_) bookmarks_.keep(shelf(), pose);
  if (next && terms_) bookmarks_.next(shelf());
  if (const auto found = bookmarks_.take_found()) interaction_.go_to(found->pose);
}

void WindowSurface::report(const FrameFigures& figures) {
  panel_.on_figures(figures);
  if (const bool waits = figures.waits_s > 0; waits != overlays_.shows("waiting"))
    overlays_.show("waiting",
                   {waits ? text_panel({"waiting for a view update"}, 2) : image::View(), Overlay::Corner::kUpperLeft});
  hands_.on_frame(figures.now_s, figures.frames);
  if (const auto title = title_.update(figures)) title_text_ = *title;
  const std::string title = interaction_.path().records() ? fmt::format("{} - recording the camera's path, {:.0f} s",
                                                                        title_text_, interaction_.path().length_s())
                                                          : title_text_;
  if (title != title_shown_) window_->set_title(title_shown_ = title);
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
