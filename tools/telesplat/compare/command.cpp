// `telesplat compare DIR`: draws poses of a recorded run with every kernel and renderer, and directly from the data.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "client/viewer/viewer_service.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/options/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/compare/report.h"
#include "tools/telesplat/compare/subject.h"
#include "tools/telesplat/record/frame_replay.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostColumns = 6;  // columns of the run's sheet

// Returns the renderers to use: those asked for; by default cpu, and gl where the machine has it.
Result<std::vector<std::string>> choose_renderers(const CompareOptions& o) {
  if (!o.renderers.empty()) {
    for (const auto& kind : o.renderers)
      if (const auto made = viewer::make_renderer(kind, o.threads); !made)
        return Error{fmt::format("--renderers {}: {}", kind, made.error().text)};
    return o.renderers;
  }
  const auto gl = viewer::make_renderer("gl", o.threads);
  if (!gl) {
    complain({"without the gl renderer: " + gl.error().text});
    return std::vector<std::string>{"cpu"};
  }
  return std::vector<std::string>{"cpu", "gl"};
}

class Comparison {
 public:
  Comparison(const CompareOptions& options, CompareSubject& subject, const splat::Finish& finish,
             const std::vector<std::string>& renderers)
      : options_(options), subject_(subject), finish_(finish), renderers_(renderers) {}

  /// Reads the data. Errors are about the data file or the record.
  Status open() {
    auto scene = subject_.scene->open_direct(options_.threads, [&](const char* stage, double fraction) {
      progress_.show(fmt::format("{}: {} {:.0f} %", subject_.name(), stage, 100 * fraction));
    });
    if (!scene) return scene.error();
    scene_ = std::move(*scene);
    auto models = ModelReplay::open(subject_.events, false);
    if (!models) return models.error();
    models_ = std::move(*models);
    return ok_status();
  }

  /// Compares pose after pose until a signal stops it. Poses compared so far count.
  Status compare_poses() {
    for (const auto& frame : subject_.frames) {
      if (net::stop_requested()) break;
      if (const Status s = compare_pose(frame); !s) return s;
    }
    progress_.close();
    return ok_status();
  }

  Status write() const {
    if (poses_.empty()) return ok_status();
    if (const Status s = write_whole(subject_.out + "/compare.csv", comparison_csv(poses_)); !s) return s;
    if (const Status s = write_whole(
            subject_.out + "/compare.json",
            comparison_json(about(), poses_).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
                "\n");
        !s)
      return s;
    std::vector<SheetRow> rows{{"reference", {}}};
    for (size_t i = 0; i < poses_.front().cells.size(); ++i) rows.push_back({median_label(poses_, i), {}});
    const size_t n = std::min(kMostColumns, columns_.size());
    for (size_t i = 0; i < n; ++i)
      for (size_t r = 0; r < rows.size(); ++r)
        rows[r].cells.push_back(columns_[(2 * i + 1) * columns_.size() / (2 * n)][r]);
    return image::write_png(subject_.out + "/contact-sheet.png",
                            contact_sheet({caption(),
                                           "figures of a row: medians over the poses; squares: where all rows together "
                                           "differ most from the reference, 4 times as large"},
                                          rows));
  }

  void print() const {
    std::printf("%s\n\n%s\nPictures and figures lie in %s (contact-sheet.png, pose-*.png, compare.csv, compare.json)\n",
                caption().c_str(), comparison_table(poses_).c_str(), subject_.out.c_str());
  }

  size_t compared() const { return poses_.size(); }

 private:
  std::string caption() const {
    const auto& c = subject_.frames.front().camera;
    return fmt::format("{}: {}, display {}x{}, sampled {}, finish {}", subject_.name(), scene_->size(), c.width,
                       c.height, subject_.sampling, splat::finish_name(finish_));
  }
  nlohmann::ordered_json about() const {
    const auto& c = subject_.frames.front().camera;
    return {{"schema", 1},
            {"scene", subject_.name()},
            {"primitives", scene_->primitives()},
            {"mode", "run"},
            {"size", {c.width, c.height}},
            {"sampling", subject_.sampling},
            {"finish", splat::finish_name(finish_)},
            {"samples", options_.samples},
            {"pixels_per_degree", options_.pixels_per_degree},
            {"repeat", options_.repeat}};
  }

  // Replays the record up to the model that the frame displayed.
  Status replay_to(const DisplayedFrame& frame) {
    const auto there = models_->advance(frame);
    if (!there) return there.error();
    if (*there) return ok_status();
    return Error{fmt::format(
        "{}: ends at event {}, frame {} displayed event {}; --frames chooses earlier frames, and telesplat run "
        "--record-points keeps more",
        subject_.events, models_->applied().value, frame.number, frame.sequence.value)};
  }

  Status compare_pose(const DisplayedFrame& frame) {
    const std::string where = fmt::format("pose {} of {}", poses_.size() + 1, subject_.frames.size());
    progress_.show(where + ": direct rendering");
    if (const Status s = replay_to(frame); !s) return s;
    const auto drawn = scene_->draw_reference(frame.camera, subject_.shading, frame.epoch, options_.samples);
    if (!drawn) return drawn.error();
    const image::Reference& reference = *drawn;
    const auto& depth = reference.view.depth_m;
    if (std::none_of(depth.begin(), depth.end(), [](float d) { return d < std::numeric_limits<float>::infinity(); }))
      return Error{fmt::format("frame {} of {}: does not show the data", frame.number, subject_.name())};
    const image::Flip flip(reference.view, options_.pixels_per_degree);

    ComparedPose pose{frame, models_->model()->points(), {}};
    const auto complete = measure_cells(*models_->model(), reference, flip, where, pose);
    if (!complete) return complete.error();
    return *complete ? keep(reference.view, std::move(pose)) : ok_status();
  }

  // Measures one cell a kernel and renderer. False: a signal stopped it in between.
  Result<bool> measure_cells(const points::PointModel& model, const image::Reference& reference,
                             const image::Flip& flip, const std::string& where, ComparedPose& pose) {
    // A pose has renderers of its own: they keep copies of points by event number, and another pose may have another
    // model with the same numbers.
    std::vector<std::unique_ptr<viewer::Renderer>> renderers;
    for (const auto& kind : renderers_) {
      auto made = viewer::make_renderer(kind, options_.threads);
      if (!made) return made.error();
      renderers.push_back(std::move(*made));
    }
    CellOptions cell;
    cell.shading = subject_.shading;
    cell.best_patch_only = subject_.best_patch_only;
    cell.repeat = options_.repeat;
    cell.detail = float(pose.frame.detail);
    cell.base = models_->base();
    for (const auto& kernel : options_.kernels) {
      cell.render = {*splat::kernel_named(kernel), finish_};
      cell.splat_scale =
          options_.splat_scale > 0 ? float(options_.splat_scale) : splat::suitable_scale(cell.render.kernel);
      for (const auto& renderer : renderers) {
        if (net::stop_requested()) return false;
        progress_.show(fmt::format("{}: {} {}", where, kernel, renderer->name()));
        pose.cells.push_back(
            measure_cell(*renderer, model, models_->applied(), pose.frame.camera, cell, {reference, flip}));
      }
    }
    return true;
  }

  Status keep(const image::View& reference, ComparedPose pose) {
    std::error_code error;
    fs::create_directories(subject_.out, error);
    if (error) return Error{fmt::format("{}: cannot be made a folder: {}", subject_.out, error.message())};
    const std::string name = fmt::format("{}/pose-{:06d}", subject_.out, pose.frame.number);
    const auto& f = pose.frame;
    const std::vector<std::string> captions{
        subject_.name(),
        fmt::format("{}, drawn directly: {} a pixel", scene_->size(),
                    options_.samples == 1 ? "one ray" : fmt::format("{} rays", options_.samples)),
        fmt::format("frame {} at {:.2f} s, event {}", f.number, f.t_s, f.sequence.value),
        fmt::format("display {}x{}", f.camera.width, f.camera.height),
        "sampled " + subject_.sampling,
        fmt::format("{} points cached", pose.points_cached),
        "finish " + splat::finish_name(finish_),
        "",
        "below: picture, FLIP error map (black is 0, white 1), the square where it errs most (4x), the reference "
        "there"};
    if (const Status s = image::write_png(name + ".png", pose_sheet(reference, pose.cells, captions)); !s) return s;
    if (options_.pictures) {
      if (const Status s = image::write_png(name + "-reference.png", reference); !s) return s;
      for (const Cell& c : pose.cells) {
        const std::string cell_name = fmt::format("{}-{}-{}", name, splat::kernel_name(c.kernel), c.renderer);
        if (const Status s = image::write_png(cell_name + ".png", c.view); !s) return s;
        const image::View errors = image::picture_of_errors(c.flip_map, reference.width, reference.height);
        if (const Status s = image::write_png(cell_name + "-flip.png", errors); !s) return s;
      }
    }
    columns_.push_back(pose_column(reference, pose.cells, fmt::format("frame {} at {:.2f} s", f.number, f.t_s)));
    for (Cell& c : pose.cells) c.view = {}, c.flip_map = {};
    poses_.push_back(std::move(pose));
    return ok_status();
  }

  const CompareOptions& options_;
  CompareSubject& subject_;
  splat::Finish finish_;
  const std::vector<std::string>& renderers_;
  tools::ProgressLine progress_;
  std::unique_ptr<DirectScene> scene_;
  std::unique_ptr<ModelReplay> models_;
  std::vector<ComparedPose> poses_;
  std::vector<std::vector<SheetCell>> columns_;  // columns of the run's sheet
};

int compare(CompareOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  if (const Status s = image::validate_samples(o.samples); !s) return complain({"--samples: " + s.error().text});
  const auto finish = splat::finish_named(o.finish);
  if (!finish) return complain({fmt::format("--finish {}: not on, off or some of fill,smooth,antialias", o.finish)});
  auto subject = find_subject(o);
  if (!subject) return complain(subject.error());
  const auto renderers = choose_renderers(o);
  if (!renderers) return complain(renderers.error());

  Comparison comparison(o, *subject, *finish, *renderers);
  if (const Status s = comparison.open(); !s) return complain(s.error());
  if (const Status s = comparison.compare_poses(); !s) return complain(s.error());
  if (const Status s = comparison.write(); !s) return complain(s.error(), 1);
  if (comparison.compared() > 0) comparison.print();
  if (comparison.compared() == subject->frames.size()) return 0;
  return complain({fmt::format("told to stop after {} of {} poses", comparison.compared(), subject->frames.size())}, 1);
}

}  // namespace

Command compare_command() {
  return make_command("compare",
                      "draw poses of a recorded run with every kernel and renderer, and directly from the data", table,
                      compare);
}

}  // namespace telesplat::launcher
