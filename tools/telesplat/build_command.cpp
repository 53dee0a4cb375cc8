// `telesplat build FILE`: makes the chunk store of a mesh ahead of its first session.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/options/complain.h"
#include "services/data/inspect.h"
#include "services/data/kinds.h"
#include "services/data/mesh/cache.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"

namespace telesplat::launcher {
namespace {

options::Table table(data::DataOptions& o) {
  options::Table out{{.flag = "file",
                      .value = &o.scene,
                      .help = "what telesplat run shows as a mesh: a mesh file, an elevation raster, or with --iso a "
                              "volume",
                      .required = true}};
  for (options::Row& row : options::without(data::scene_table(o), {"--no-cache", "--colour-map"}))
    if (row.fits.has(scene::Kind::kMesh)) out.push_back(std::move(row));
  return out;
}

Status check(const data::DataOptions& o) {
  const auto kind = data::kind_of(o);
  if (!kind) return kind.error();
  if (*kind == scene::Kind::kMesh) return ok_status();
  return Error{fmt::format("{}: is {}, which has no chunk store{}", o.scene, scene::described(*kind),
                           *kind == scene::Kind::kVolume ? "; its surface has one (--iso)" : "")};
}

int build(data::DataOptions o, const options::Given&) {
  log::initialise("telesplat", "warn");
  if (const Status s = check(o); !s) return complain(s.error());
  data::MeshOptions options = o.mesh_options();
  options.must_keep = true;
  const double begin_s = monotonic_s();
  tools::ProgressLine progress(2);
  const auto store =
      data::open_mesh(o.scene, options, [&](const char* what, double fraction) { progress.show(what, fraction); });
  progress.close();
  if (!store) return complain(store.error());
  const data::MeshFileFacts facts = data::sum_up((*store)->info(), (*store)->chunks());
  for (const std::string& note : facts.info.notes) std::fprintf(stderr, "telesplat: %s\n", note.c_str());
  std::error_code error;
  const uint64_t bytes = std::filesystem::file_size(facts.info.kept_in, error);
  const std::string how =
      facts.info.from_cache ? "already there" : "made in " + tools::duration_text(monotonic_s() - begin_s);
  fmt::print("{}: {} triangles, {} levels above them, {}, {:.1f} bytes a triangle, {}: {}\n", o.scene,
             facts.info.triangles, facts.levels, data::size_text(bytes), double(bytes) / double(facts.info.triangles),
             how, data::short_path(facts.info.kept_in));
  return 0;
}

}  // namespace

Command build_command() {
  return make_command("build", "make a mesh's chunk store, so that its first session begins at once", table, build);
}

}  // namespace telesplat::launcher
