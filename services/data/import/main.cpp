// telesplat-import FORMAT FILE: reads a glTF, a mesh with pictures, a raster, slices or DICOM files with foreign
// libraries and writes the result to standard output for the process that started it (process.cpp). A program of its
// own, so that crashes, messages and exploits of these libraries stay in it.
#include <fmt/format.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <new>
#include <span>
#include <vector>

#include "common/image/file.h"
#include "services/data/base/cut_off.h"
#include "services/data/gltf/reader.h"
#include "services/data/import/confine.h"
#include "services/data/import/dicom.h"
#include "services/data/import/files.h"
#include "services/data/import/gdal.h"
#include "services/data/import/process.h"
#include "services/data/mesh/formats/readers.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {
namespace {

class PicturedFiles final : public ImportFiles {
 public:
  using ImportFiles::ImportFiles;
  Result<image::View> picture(std::string_view bytes, const std::string& name, uint64_t most_pixels) override {
    return image::read_picture(std::as_bytes(std::span(bytes)), name, most_pixels);
  }
};

// Ends this process after a time: a hostile file must not keep it busy for ever.
void limit_time(uint64_t bytes) { alarm(static_cast<unsigned>(60 + bytes / 1'000'000)); }

// Returns the limit of memory: the memory mapped so far, a gigabyte, and `more`.
uint64_t memory_with(uint64_t more) {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) + (uint64_t{1} << 30) + more;
}

Result<Mesh> import_mesh(ImportFiles& files, const std::string& format, const std::string& path,
                         uint64_t texture_detail, const std::string& array) {
  const auto content = files.content();
  if (!content) return Error{fmt::format("{}: {}", path, content.error().text)};
  if (format == "obj") return read_obj(*content, path, nullptr, files, texture_detail);
  if (format == "ply") return read_ply(*content, path, nullptr, files, array, texture_detail);
  if (format == "gltf") return read_gltf(*content, path, files, texture_detail);
  return Error{fmt::format("{}: {} is no format that is read here", path, format)};
}

// Sends all frames of all files, one after the other, as one volume. bytes: of their pixels.
bool import_dicom(int out, const ImportFiles& files, uint64_t bytes) {
  limit_time(bytes / 4);
  confine(memory_with(3 * bytes + 16 * files.bytes()));
  VolumeFileHeader header;
  std::vector<char> pixels;
  for (const ImportFile& file : files.all()) {
    const auto mapped = file.map();
    if (!mapped) return send_error(out, mapped.error().text);
    const auto frames = decode_dicom((*mapped)->text(), file.path());
    if (!frames) return send_error(out, frames.error().text);
    const auto stored = frames->bytes == 1 ? StoredType::kU8 : frames->bytes == 2 ? StoredType::kU16 : StoredType::kU32;
    const bool first = header.size[2] == 0;
    if (!first && (frames->columns != header.size[0] || frames->rows != header.size[1] || stored != header.stored))
      return send_error(out, file.path() + ": GDCM finds pixels of another size than in the files before");
    header.size = {frames->columns, frames->rows, header.size[2] + frames->frames};
    header.stored = stored;
    pixels.insert(pixels.end(), frames->pixels.begin(), frames->pixels.end());
  }
  return pixels.size() == header.voxel_bytes() && send_volume(out, header, pixels.data());
}

bool import_stack(int out, ImportFiles& files, const std::string& path, const std::string& layout) {
  const auto header = parse_raw_spec(layout, path);
  if (!header) return send_error(out, header.error().text);
  limit_time(header->voxel_bytes());
  confine(memory_with(2 * header->voxel_bytes() + 2 * files.bytes()));
  const auto voxels = read_stack(files, *header, [&](double f) { send_progress(out, f); });
  if (!voxels) return send_error(out, voxels.error().text);
  return send_volume(out, *header, voxels->data());
}

}  // namespace

}  // namespace telesplat::data

int main(int argc, char** argv) {
  using namespace telesplat;
  using namespace telesplat::data;
  if (argc < 3 || argc > 5) {
    std::fputs(
        "usage: telesplat-import gltf|obj|ply FILE TEXTURE_DETAIL [ARRAY]   (standard input: files.h; output: "
        "report.h)\n"
        "       telesplat-import dicom NAME BYTES    (standard output: import_stream.h)\n"
        "       telesplat-import stack NAME SIZExSIZExSIZE:TYPE  (standard output: import_stream.h)\n"
        "       telesplat-import raster FILE TEXTURE|'' SAMPLES  (heights: process.h)\n"
        "       telesplat-import raster-facts FILE   (standard output: raster_facts.h)\n",
        stderr);
    return 2;
  }
  const std::string format = argv[1], path = argv[2];
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with its parent, which waits for the result
  // This program's libraries take a second or more to load; the parent may have died meanwhile.
  if (const char* parent = std::getenv(kParentVariable); parent && std::atoi(parent) != getppid()) return 1;
  end_at_cut_off_files(kCutOffExit);
  PicturedFiles files(STDIN_FILENO);
  const uint64_t file_bytes = files.bytes();
  const int out = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // output of libraries must not mix with the result
  try {
    limit_time(file_bytes);
    if (format == "stack" && argc == 4) return import_stack(out, files, path, argv[3]) ? 0 : 1;
    if (format == "dicom" && argc == 4) return import_dicom(out, files, std::strtoull(argv[3], nullptr, 10)) ? 0 : 1;
    const bool raster = format.starts_with("raster");
    const uint64_t texture_detail = !raster && argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 0;
    // Pictures may hold many texels per byte; baked triangles are divided into a copy.
    const uint64_t pictures = raster ? 0 : (uint64_t{3} << 30) + 300 * texture_detail;
    confine(memory_with(100 * file_bytes + pictures));
    if (format == "raster-facts") {
      const auto facts = read_raster_facts(files, path);
      return write_import_report(out, facts ? Result(to_notes(*facts)) : facts.error()) ? 0 : 1;
    }
    if (raster && argc == 5) {
      const ElevationOptions options{.texture = argv[3], .most_samples = std::atoll(argv[4])};
      return write_heights_report(out, read_elevation(files, path, options)) ? 0 : 1;
    }
    const auto mesh = import_mesh(files, format, path, texture_detail, argc == 5 ? argv[4] : "");
    return write_import_report(out, mesh) ? 0 : 1;
  } catch (const std::bad_alloc&) {
    const Error error{fmt::format("{}: claims more data than a file of {} bytes can hold", path, file_bytes)};
    return write_import_report(out, error) ? 0 : 1;
  } catch (...) {
    return 1;
  }
}
