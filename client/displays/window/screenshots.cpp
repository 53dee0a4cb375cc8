#include "client/displays/window/screenshots.h"

#include <fmt/format.h>

#include <ctime>
#include <filesystem>

#include "common/core/guarded.h"

namespace telesplat::viewer {

namespace {

namespace fs = std::filesystem;

std::string local_time() {
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::localtime(&now));
  return date;
}

}  // namespace

std::string new_file(const std::string& folder, const std::string& what, const std::string& ending) {
  std::error_code error;
  fs::create_directories(folder, error);
  const std::string name = fmt::format("{}/{}-{}", folder, what, local_time());
  std::string out = name + ending;
  for (int n = 2; fs::exists(out, error); ++n) out = fmt::format("{}-{}{}", name, n, ending);
  return out;
}

Screenshots::Screenshots(std::string directory, std::function<void(const std::string&)> tell)
    : directory_(std::move(directory)), tell_(std::move(tell)) {}

Screenshots::~Screenshots() {
  if (writing_.valid()) writing_.wait();
}

std::string Screenshots::next_path(const char* ending) {
  std::string path;
  std::error_code error;
  do {
    path = fmt::format("{}/telesplat-{}-{:03d}.{}", directory_, local_time(), ++count_, ending);
  } while (fs::exists(path, error));
  return path;
}

void Screenshots::take(const image::View& view, image::Alpha alpha, bool exr) {
  image::View copy{view.width, view.height, view.colour, exr ? view.depth_m : std::vector<float>()};
  writing_ = std::async(std::launch::async, [this, alpha, exr, path = next_path(exr ? "exr" : "png"),
                                             before = std::move(writing_), copy = std::move(copy)]() {
    if (before.valid()) before.wait();
    const Status done = guarded("a screenshot", [&] {
      std::error_code error;
      fs::create_directories(directory_, error);
      const Status written = exr ? image::write_exr(path, copy, alpha) : image::write_png(path, copy, alpha);
      tell_(written ? "screenshot: " + path : written.error().text);
    });
    if (!done) tell_(path + ": " + done.error().text);
  });
}

}  // namespace telesplat::viewer
