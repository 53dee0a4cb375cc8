// Reads any bytes as files of run folders and sweeps, and as scene files, as the launcher does: tables, manifests,
// session.toml. The first byte chooses.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/core/log.h"
#include "tests/support/files/memory_file.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/record/recorded_run.h"
#include "tools/telesplat/report/reading/run_tables.h"
#include "tools/telesplat/report/report.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/scene/scene_file.h"
#include "tools/telesplat/sweep/manifest.h"

namespace telesplat::launcher {
namespace {

// A folder of this process that holds one file at a time.
class Folder {
 public:
  Folder() : path_("/tmp/telesplat-fuzz-XXXXXX") {
    if (!mkdtemp(path_.data())) std::abort();
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::string& with(const char* name, std::string_view content) {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove_all(entry);
    std::ofstream(path_ + "/" + name, std::ios::binary) << content;
    return path_;
  }

 private:
  std::string path_;
};

void tables(const std::string& path) {
  if (const auto table = tools::CsvTable::read(path, {.rows = 1000, .line_bytes = 1 << 16}); table.ok())
    for (size_t c = 0; c < table->header().size(); ++c) {
      table->numbers(c);
      for (size_t r = 0; r < table->rows(); ++r) {
        table->text(r, c);
        if (const auto n = table->number(r, c); n.ok() && !std::isfinite(*n)) std::abort();
        (void)table->count(r, c);
      }
    }
  const auto loose = LooseTable::read(path, {"frame", "t_s", "a"}, {"name"});
  if (loose.ok() && (loose->numbers("a").size() != loose->rows() || loose->texts("name").size() > loose->rows()))
    std::abort();
}

}  // namespace
}  // namespace telesplat::launcher

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  using namespace telesplat::launcher;
  static Folder folder;
  log::initialise("fuzz", "off");
  if (size == 0) return 0;
  const std::string_view content(reinterpret_cast<const char*>(data) + 1, size - 1);
  const test::MemoryFile file({data + 1, size - 1});
  switch (data[0] % 6) {
    case 0:
      tables(file.path());
      break;
    case 1:
      static_cast<void>(settle_report({.runs = {folder.with("sweep.csv", content)}, .labels = {}}));
      break;
    case 2:
      (void)read_manifest(folder.with(kManifestFile, content));
      break;
    case 3:
      (void)read_report(folder.with("summary.json", content));
      break;
    case 4:
      (void)read_recorded_run(folder.with("session.toml", content));
      break;
    default: {
      static RunOptions run;
      static const telesplat::options::Table flags = telesplat::launcher::table(run);
      (void)read_scene_file(file.path(), flags);
    }
  }
  return 0;
}
