#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <fstream>

#include "services/data/gltf_header.h"
#include "services/data/mapped_file.h"
#include "services/data/mesh_reader.h"
#include "services/data/vtk_import.h"

namespace telesplat::data {
namespace {

// What the child leaves in the shared file: this, then the error's text or the mesh's arrays.
struct Report {
  uint64_t text_bytes = 0;  // of an error; 0: a mesh follows
  uint64_t vertices = 0, triangles = 0, degenerate = 0;
  uint32_t normals = 0, colours = 0;
};

bool write_all(int descriptor, const void* data, size_t bytes) {
  const char* p = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = write(descriptor, p, std::min(bytes, size_t{1} << 30));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    p += n, bytes -= static_cast<size_t>(n);
  }
  return true;
}

bool write_report(int descriptor, const Result<Mesh>& result) {
  Report report;
  if (!result) {
    report.text_bytes = result.error().text.size();
    return write_all(descriptor, &report, sizeof report) && write_all(descriptor, result.error().text.data(), report.text_bytes);
  }
  const Mesh& mesh = *result;
  report = {0, mesh.positions.size(), mesh.indices.size() / 3, mesh.degenerate_dropped, !mesh.normals.empty(), !mesh.colours.empty()};
  const auto put = [&](const auto& array) { return write_all(descriptor, array.data(), array.size() * sizeof(array[0])); };
  return write_all(descriptor, &report, sizeof report) && put(mesh.positions) && put(mesh.normals) && put(mesh.colours) && put(mesh.indices);
}

// Memory that a reader may take at most: what this process has mapped already, and a hundred times the file. Sanitizers
// map terabytes of shadow, so there the limit is left out.
void limit_memory(uint64_t file_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t bytes = pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) + (uint64_t{1} << 30) + 100 * file_bytes;
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
#else
  static_cast<void>(file_bytes);
#endif
}

// The life of the child. It does not return.
[[noreturn]] void run_child(int descriptor, const std::string& path, const std::string& format, uint64_t file_bytes) {
  const int null = open("/dev/null", O_RDWR);
  dup2(null, STDOUT_FILENO), dup2(null, STDERR_FILENO);
  for (int signal : {SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGBUS}) std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  alarm(static_cast<unsigned>(60 + file_bytes / 1'000'000));  // a hostile file must not keep it for ever
  limit_memory(file_bytes);
  bool written = false;
  try {
    written = write_report(descriptor, import_with_vtk(path, format));
  } catch (const std::bad_alloc&) {
    written = write_report(descriptor, Error{fmt::format("{}: claims more data than a file of {} bytes can hold", path, file_bytes)});
  } catch (...) {
  }
  _exit(written ? 0 : 1);
}

template <class T>
bool take(std::span<const std::byte>& bytes, uint64_t count, std::vector<T>& out) {
  if (count > bytes.size() / sizeof(T)) return false;
  out.resize(count);
  std::memcpy(out.data(), bytes.data(), count * sizeof(T));
  bytes = bytes.subspan(count * sizeof(T));
  return true;
}

Result<Mesh> read_report(int descriptor, const std::string& path, const std::string& format) {
  const auto mapped = MappedFile::map(descriptor, path);
  const Error incomplete{fmt::format("{}: what VTK's reader left is incomplete", path)};
  if (!mapped || (*mapped)->bytes().size() < sizeof(Report)) return incomplete;
  Report report;
  std::memcpy(&report, (*mapped)->bytes().data(), sizeof report);
  auto rest = (*mapped)->bytes().subspan(sizeof report);
  if (report.text_bytes > 0) return Error{std::string((*mapped)->text().substr(sizeof report, report.text_bytes))};
  Mesh mesh;
  mesh.format = format;
  mesh.degenerate_dropped = report.degenerate;
  const bool whole = take(rest, report.vertices, mesh.positions) && take(rest, report.normals ? report.vertices : 0, mesh.normals) &&
                     take(rest, report.colours ? report.vertices : 0, mesh.colours) && take(rest, 3 * report.triangles, mesh.indices);
  if (!whole) return incomplete;
  return mesh;
}

// The number behind `key` (and a quote or blank); 0 if there is none.
uint64_t number_after(std::string_view content, std::string_view key, size_t& at) {
  at = content.find(key, at);
  if (at == content.npos) return 0;
  at += key.size();
  while (at < content.size() && (content[at] == ' ' || content[at] == '"')) ++at;
  uint64_t value = 0;
  const auto parsed = std::from_chars(content.data() + at, content.data() + content.size(), value);
  return parsed.ec == std::errc::result_out_of_range ? ~uint64_t{0} : value;
}

// Counts in a header that no file of this size can hold. `expansion`: the most that a byte of the file can become.
Status check_counts(std::string_view content, const std::string& name, std::initializer_list<const char*> keys, uint64_t expansion) {
  for (const char* key : keys)
    for (size_t at = 0; at != content.npos;) {
      const uint64_t claimed = number_after(content, key, at);
      if (claimed > content.size() * expansion)
        return Error{fmt::format("{}: claims {} {} in a file of {} bytes", name, claimed, key[0] == '\n' ? key + 1 : key, content.size())};
    }
  return ok_status();
}

Status check_before(std::string_view content, const std::string& format, const std::string& path) {
  if (format == "gltf") {
    uint64_t bytes = content.size();
    for (const std::string& companion : companion_files(content, format, path)) {
      const auto file = MappedFile::open(companion);
      if (!file) return Error{fmt::format("{}: needs a file that is missing: {}", path, file.error().text)};
      bytes += (*file)->bytes().size();
    }
    return check_gltf(content, bytes, path);
  }
  if (format == "vtp") {
    // zlib packs at most 1032 to 1.
    return check_counts(content, path, {"NumberOfPoints=", "NumberOfPolys=", "NumberOfStrips=", "NumberOfVerts=", "NumberOfLines=", "NumberOfTuples="}, 1032);
  }
  const size_t dataset = content.substr(0, 4096).find("DATASET");
  if (dataset == content.npos || !content.starts_with("# vtk DataFile")) return Error{path + ": is no legacy VTK file: no DATASET near its start"};
  std::string_view kind = content.substr(dataset + 7, 40);
  while (!kind.empty() && kind.front() == ' ') kind.remove_prefix(1);
  kind = kind.substr(0, kind.find_first_of(" \r\n"));
  if (kind != "POLYDATA" && kind != "polydata")
    return Error{fmt::format("{}: is a VTK file of {} (a volume or grid), not of POLYDATA: only polygonal meshes are read", path, kind)};
  return check_counts(content, path, {"\nPOINTS ", "\nPOLYGONS ", "\nTRIANGLE_STRIPS ", "\nPOINT_DATA ", "\nCELL_DATA "}, 1);
}

}  // namespace

Result<Mesh> read_with_vtk(std::string_view content, const std::string& format, const std::string& path, const ReadProgress& progress) {
  if (auto status = check_before(content, format, path); !status) return status.error();
  if (progress) progress(0.0);
  const int descriptor = memfd_create("telesplat-import", MFD_CLOEXEC);
  if (descriptor < 0) return Error{fmt::format("{}: no memory file for reading it: {}", path, std::strerror(errno))};
  const pid_t child = fork();
  if (child == 0) run_child(descriptor, path, format, content.size());
  int status = 0;
  const bool waited = child > 0 && [&] {
    while (waitpid(child, &status, 0) < 0)
      if (errno != EINTR) return false;
    return true;
  }();
  auto result = [&]() -> Result<Mesh> {
    if (!waited) return Error{fmt::format("{}: no process for reading it: {}", path, std::strerror(errno))};
    if (WIFSIGNALED(status))
      return Error{fmt::format("{}: is damaged: VTK's {} reader {}", path, format, WTERMSIG(status) == SIGALRM ? "did not end" : "crashed on it")};
    if (WEXITSTATUS(status) != 0) return Error{fmt::format("{}: is damaged: VTK's {} reader gave up", path, format)};
    return read_report(descriptor, path, format);
  }();
  close(descriptor);
  return result;
}

}  // namespace telesplat::data
