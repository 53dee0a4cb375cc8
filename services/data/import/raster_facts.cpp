#include "services/data/import/raster_facts.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "services/data/base/mapped_file.h"
#include "services/data/import/process.h"
#include "services/data/import/report.h"

namespace telesplat::data {
namespace {

// One line of text: what a file says of itself may hold anything.
std::string line_of(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  return text.substr(0, 300) + "\n";
}

Result<RasterFacts> parse(std::string_view text, const std::string& path) {
  std::istringstream in{std::string(text)};
  std::string first;
  std::getline(in, first);
  if (first == "error") {
    std::string why;
    std::getline(in, why);
    return Error{why};
  }
  RasterFacts f;
  std::getline(in, f.format), std::getline(in, f.type), std::getline(in, f.reference), std::getline(in, f.unit);
  std::getline(in, f.height_unit);
  in >> f.width >> f.height >> f.step >> f.west >> f.south >> f.east >> f.north >> f.sample_x >> f.sample_y >>
      f.sample_x_m >> f.sample_y_m >> f.lo >> f.hi >> f.height_m >> f.without_data;
  if (first != "raster" || !in) return Error{fmt::format("{}: what {} left of it is incomplete", path, kImportProgram)};
  return f;
}

}  // namespace

bool write_raster_facts(int descriptor, const Result<RasterFacts>& facts) {
  std::string text;
  if (!facts) {
    text = "error\n" + line_of(facts.error().text);
  } else {
    const RasterFacts& f = *facts;
    text = "raster\n" + line_of(f.format) + line_of(f.type) + line_of(f.reference) + line_of(f.unit) +
           line_of(f.height_unit);
    text += fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {}\n", f.width, f.height, f.step, f.west, f.south,
                        f.east, f.north, f.sample_x, f.sample_y, f.sample_x_m, f.sample_y_m, f.lo, f.hi, f.height_m,
                        f.without_data);
  }
  return write(descriptor, text.data(), text.size()) == ssize_t(text.size());
}

Result<RasterFacts> inspect_raster(const std::vector<std::string>& files) {
  const std::string& path = files[0];
  const int output = memfd_create("telesplat-import", MFD_CLOEXEC);
  if (output < 0) return Error{fmt::format("{}: no memory file for reading it: {}", path, std::strerror(errno))};
  const auto result = [&]() -> Result<RasterFacts> {
    const auto child = start_import({"raster-facts", path}, files, output);
    if (!child) return child.error();
    if (auto status = end_import(*child, "GDAL's raster", "raster", path); !status) return status.error();
    const auto left = MappedFile::map(output, path);
    return parse(left ? (*left)->text() : "", path);
  }();
  close(output);
  return result;
}

}  // namespace telesplat::data
