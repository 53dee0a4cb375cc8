#include "tools/telesplat/movie/movie.h"

#include <fmt/format.h>

#include <cmath>

#include "common/core/clock.h"
#include "tools/common/time_left.h"
#include "tools/telesplat/movie/contact_sheet.h"
#include "tools/telesplat/movie/picture_sink.h"
#include "tools/telesplat/movie/screen.h"

namespace telesplat::launcher {
namespace {

constexpr double kMostFrames = 1e7;

/// "making the movie 43 %, 12 s left"
class Progress {
 public:
  Progress(tools::ProgressLine& line, const char* what, uint64_t of) : line_(line), what_(what), of_(of) {}

  void show(uint64_t done) { line_.show(left_.text(what_, double(done) / double(of_), monotonic_s())); }

 private:
  tools::ProgressLine& line_;
  tools::TimeLeft left_;
  const char* what_;
  uint64_t of_;
};

std::string cut_short(const Screen& screen, double t_s) {
  return fmt::format(
      "{} ends before frame {}: the record was cut short (--record-points limits it), and so this ends after {:.2f} s "
      "of "
      "{:.2f} s",
      screen.record_file(), screen.frame().number, t_s, screen.duration_s());
}

// How to make a movie of pictures: a line for a shell.
std::string advice(const MovieTarget& target, double fps) {
  std::string command = fmt::format("ffmpeg -framerate {} -i {}", fps, shell_quoted(target.pattern()));
  for (const char* word : {"-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-vf",
                           "crop=trunc(iw/2)*2:trunc(ih/2)*2", target.wanted_video.c_str()})
    command += " " + shell_quoted(word);
  return fmt::format(
      "ffmpeg is not installed, so there are pictures instead of {}; where it is, this makes the movie of them:\n  {}",
      target.wanted_video, command);
}

class Movie {
 public:
  Movie(Screen& screen, const MoviePlan& plan, const ShouldStop& should_stop)
      : screen_(screen), plan_(plan), should_stop_(should_stop) {}

  Result<MovieReport> make(tools::ProgressLine& line) {
    const double fps = plan_.options.fps;
    const double frames = std::floor(screen_.duration_s() * fps) + 1;
    if (!(frames <= kMostFrames))
      return Error{fmt::format("{}: a movie of {:.0f} frames; at most {:.0f}", plan_.target.path, frames, kMostFrames)};
    const auto alpha = screen_.run().transparent ? image::Alpha::kCoverage : image::Alpha::kNone;
    auto sink = PictureSink::open(plan_.target, screen_.width(), screen_.height(), fps, alpha, should_stop_);
    if (!sink) return MovieReport{.written = sink.error()};
    const auto count = draw(**sink, uint64_t(frames), line);
    if (!count) return count.error();
    if (should_stop_()) return MovieReport{.interrupted = true};
    if (report_.written) report_.written = (*sink)->finish();
    if (should_stop_()) return MovieReport{.interrupted = true};
    if (report_.written) describe(*count, (*sink)->with());
    return std::move(report_);
  }

 private:
  // How many frames the movie has. What cannot be written stands in the report.
  Result<uint64_t> draw(PictureSink& sink, uint64_t frames, tools::ProgressLine& line) {
    Progress progress(line, "making the movie", frames);
    progress.show(0);
    for (uint64_t k = 0; k < frames; ++k) {
      if (should_stop_()) return k;
      const double t_s = double(k) / plan_.options.fps;
      const auto shown = screen_.show(t_s);
      if (!shown) return shown.error();
      if (*shown == Screen::Shown::kRecordEnds) {
        if (k == 0) return Error{cut_short(screen_, 0)};
        report_.lines.push_back(cut_short(screen_, t_s));
        return k;
      }
      report_.written = sink.add(screen_.view(), *shown == Screen::Shown::kSame);
      if (!report_.written) return k;
      progress.show(k + 1);
    }
    return frames;
  }

  void describe(uint64_t frames, const std::string& with) {
    const MovieTarget& target = plan_.target;
    const bool pictures = target.kind == MovieTarget::Kind::kPictures;
    report_.lines.push_back(fmt::format("{}: {} frames of {}x{} ({}), {} a second, {:.2f} s; {} displayed frames of {}",
                                        pictures ? target.pattern() : target.path, frames, screen_.width(),
                                        screen_.height(), with, plan_.options.fps, double(frames) / plan_.options.fps,
                                        screen_.drawn(), screen_.run().frames.size()));
    if (screen_.run().transparent && !pictures)
      report_.lines.push_back("a video has no transparency: the background is black; a folder of pictures has alpha");
    if (target.wanted_video.empty()) return;
    report_.lines.push_back(advice(target, plan_.options.fps));
    report_.instead = true;
  }

  Screen& screen_;
  const MoviePlan& plan_;
  const ShouldStop& should_stop_;
  MovieReport report_;
};

Result<MovieReport> make_sheet(Screen& screen, const MoviePlan& plan, tools::ProgressLine& line,
                               const ShouldStop& should_stop) {
  const int count = plan.options.pictures;
  Progress progress(line, "making the contact sheet", uint64_t(count));
  ContactSheet sheet(screen.run().directory);
  MovieReport report;
  for (int i = 0; i < count; ++i) {
    if (should_stop()) return MovieReport{.interrupted = true};
    const double t_s = count == 1 ? screen.duration_s() / 2 : screen.duration_s() * i / (count - 1);
    const auto shown = screen.show(t_s);
    if (!shown) return shown.error();
    if (*shown == Screen::Shown::kRecordEnds) {
      if (i == 0) return Error{cut_short(screen, 0)};
      report.lines.push_back(cut_short(screen, t_s));
      break;
    }
    sheet.add(screen.view(), screen.frame());
    progress.show(uint64_t(i) + 1);
  }
  const std::string& path = plan.target.path;
  report.written = sheet.write(path, fmt::format("{}, {:.1f} s, {} frames", screen.run().scene->name(),
                                                 screen.duration_s(), screen.run().frames.size()));
  if (report.written) report.lines.push_back(fmt::format("{}: {} frames of the run", path, sheet.pictures()));
  return report;
}

}  // namespace

Result<MoviePlan> plan_movie(const MovieOptions& options, const char* size_flag) {
  const auto size = movie_size(options, size_flag);
  if (!size) return size.error();
  auto target = movie_target(options.file);
  if (!target) return target.error();
  const Container* container = container_of(options.file);
  if (container && container->even_sides && (size->first % 2 || size->second % 2))
    return Error{fmt::format("{} {}: a {} movie has even sides", size_flag, options.size, container->extension)};
  return MoviePlan{options, std::move(*target), size->first, size->second, size_flag};
}

Result<MovieReport> make_movie(const std::string& run_directory, const MoviePlan& plan, tools::ProgressLine& progress,
                               const ShouldStop& should_stop) {
  auto screen = Screen::open(run_directory, plan.width, plan.height, plan.size_flag, plan.options.threads);
  if (!screen) return screen.error();
  auto report = plan.target.kind == MovieTarget::Kind::kSheet ? make_sheet(*screen, plan, progress, should_stop)
                                                              : Movie(*screen, plan, should_stop).make(progress);
  progress.close();
  if (report) report->lines.insert(report->lines.begin(), screen->notes().begin(), screen->notes().end());
  return report;
}

}  // namespace telesplat::launcher
