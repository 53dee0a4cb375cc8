#include "tools/telesplat/movie/movie_options.h"

#include "client/viewer/display/size_text.h"

namespace telesplat::launcher {
namespace {

const options::Range kFps{0.1, 1000};

}  // namespace

options::Table movie_rows(MovieOptions& o) {
  return {
      {.flag = "--movie",
       .value = &o.file,
       .help = "after the run make a movie of the frames that were displayed: FILE.mp4 (or .mov, .mkv, .avi, .webm, "
               ".gif, through ffmpeg), a folder/ or folder/%06d.png of pictures, FILE.png for a contact sheet",
       .not_in_scene = "where a run writes"},
      {.flag = "--movie-fps", .value = &o.fps, .help = "frames a second of the movie", .limits = kFps},
      {.flag = "--movie-size", .value = &o.size, .help = "pixels of the movie, WxH; default: the display's"}};
}

options::Table movie_table(MovieOptions& o) {
  return {{.flag = "--fps", .value = &o.fps, .help = "frames a second of the movie", .limits = kFps},
          {.flag = "--size", .value = &o.size, .help = "pixels of a frame, WxH; default: the display's"},
          {.flag = "--pictures",
           .value = &o.pictures,
           .help = "pictures of a contact sheet, evenly spaced in time",
           .limits = options::Range{1, 400}},
          {.flag = "--threads",
           .value = &o.threads,
           .help = "threads to draw with; 0: one a core",
           .limits = options::Range{0, 1024}}};
}

Result<std::pair<int, int>> movie_size(const MovieOptions& o, const char* flag) {
  if (o.size.empty()) return std::pair{0, 0};
  return viewer::parse_size(o.size, flag);
}

}  // namespace telesplat::launcher
