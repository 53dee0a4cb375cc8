#include "services/data/data_service.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "services/data/julia/service.h"
#include "services/data/volume/service.h"

namespace telesplat::data {
namespace {

// Progress goes to the launcher's pipe, or to the log every two seconds.
Progress make_progress(bool to_stdout) {
  return [to_stdout, last_s = monotonic_s()](const char* stage, double fraction) mutable {
    const double now = monotonic_s();
    if (to_stdout) {
      std::printf("progress %s %.3f\n", stage, fraction);
      std::fflush(stdout);
    } else if (now - last_s >= 2.0) {
      log::info("{}: {:.0f} %", stage, fraction * 100);
      last_s = now;
    }
  };
}

wire::Hello make_hello(const DataServiceOptions& o, const MeshStore& store, const std::string& endpoint) {
  const MeshStoreInfo& info = store.info();
  wire::Hello hello;
  hello.role = "data";
  hello.name = o.service.name;
  hello.endpoints = {{"chunks", endpoint}};
  hello.facts = {{"scene", std::filesystem::path(o.scene).filename().string()},
                 {"kind", "mesh"},
                 {"format", info.format},
                 {"triangles", std::to_string(info.triangles)},
                 {"vertices", std::to_string(info.vertices)},
                 {"degenerate_dropped", std::to_string(info.degenerate_dropped)},
                 {"up", info.up},
                 {"from_cache", info.from_cache ? "true" : "false"},
                 {"content_hash", fmt::format("{:016x}", info.content_hash)}};
  hello.box_room = info.box_room;
  return hello;
}

int run_volume(const DataServiceOptions& o) {
  const double begin_s = monotonic_s();
  const auto store = VolumeStore::open(o.scene, to_options(o.volume), o.mesh, make_progress(o.report_progress));
  if (!store) {
    std::fprintf(stderr, "telesplat: %s\n", store.error().text.c_str());
    return 2;
  }
  net::install_signal_handlers();  // until here a signal ended the process: what was being read is read again next time
  const volume::Session& session = (*store)->session();
  const auto& size = session.grid.size;
  log::info("{}: {} x {} x {} voxels{}, values {:g} to {:g} (mostly {:g} to {:g}{}) in {} levels; ready in {:.0f} ms",
            o.scene, size[0], size[1], size[2], session.steps > 1 ? fmt::format(", {} steps", session.steps) : "",
            session.range.lo, session.range.hi, session.range.typical_lo, session.range.typical_hi,
            session.range.hounsfield ? ", Hounsfield units" : "", session.levels.count,
            1e3 * (monotonic_s() - begin_s));
  net::Context context;
  return serve_volume(context, **store, o, [] { return false; });
}

}  // namespace

void add_flags(CLI::App& app, DataServiceOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kBoth);
  app.add_option("scene", o.scene,
                 "mesh file (PLY, OBJ, STL, OFF, VTP, VTK, glTF, GLB), elevation raster (GeoTIFF, HGT, 16-bit PNG), "
                 "volume (NRRD, "
                 "MetaImage, NIfTI, VTI, raw with --raw, a folder of DICOM slices or of a numbered series), or julia")
      ->required();
  app.add_option("--room-size", o.mesh.room_size_m, "largest extent of the data set in room space, metres")
      ->capture_default_str()
      ->check(CLI::Range(1e-3, 1e3));
  app.add_option("--up", o.mesh.up, "data axis that points up: x, y, z, -x, -y, -z or auto")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "x", "y", "z", "-x", "-y", "-z"}));
  app.add_option(
         "--z-scale", o.mesh.elevation.z_scale,
         "elevation rasters: heights times this; 0: 1 where the file says where it lies, else so that the relief "
         "is a seventh of its side")
      ->capture_default_str()
      ->check(CLI::Range(-1e6, 1e6));
  app.add_option("--texture", o.mesh.elevation.texture, "elevation rasters: an image draped over them");
  app.add_option("--cache", o.mesh.cache_dir,
                 "folder of the chunk store; default: telesplat in the user's cache folder");
  app.add_flag("!--no-cache", o.mesh.use_cache, "keep no chunk store");
  app.add_flag("--report-progress", o.report_progress, "print progress lines on stdout");
  app.add_option("--iso", o.mesh.iso, "volumes: show the surface where they have this value, as a mesh");
  add_volume_flags(app, o.volume);
  julia::add_scene_flags(app, o.julia);
}

int run(const DataServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  const auto refuse = [&](const char* why) {
    std::fprintf(stderr, "telesplat: %s: %s\n", o.scene.c_str(), why);
    return 2;
  };
  const bool is_julia = o.scene == julia::kSceneWord;
  if (!is_julia && o.julia.any()) return refuse("is a file, but a Julia set's parameters are given");
  const bool surface = o.mesh.iso.has_value();
  if (!is_julia && !surface && (!o.volume.raw.empty() || looks_like_volume(o.scene))) return run_volume(o);
  if (o.volume.any_but_raw())
    return refuse(
        surface
            ? "is shown as a surface (--iso), but --tf, --lighting, --series-rate, --part or --volume-cache-mb is given"
            : "is no volume, but --tf, --lighting, --series-rate, --part or --volume-cache-mb is given");
  if (is_julia)
    return o.volume.raw.empty() && !surface ? run_julia(o) : refuse("is a Julia set, but --raw or --iso is given");
  MeshOptions mesh = o.mesh;
  mesh.raw = o.volume.raw;
  const auto store = MeshStore::open(o.scene, mesh, make_progress(o.report_progress));
  if (!store) {
    std::fprintf(stderr, "telesplat: %s\n", store.error().text.c_str());
    return 2;
  }
  net::install_signal_handlers();  // until here a signal ended the process: what was being read is read again next time
  const MeshStoreInfo& info = (*store)->info();
  if (info.degenerate_dropped) log::info("{} degenerate triangles dropped", info.degenerate_dropped);
  log::info("{}: {} triangles in {} chunks{}", o.scene, info.triangles, (*store)->chunks().size(),
            info.from_cache ? " (from the chunk store)" : "");

  net::Context context;
  net::Socket blocks(context, net::Kind::kRouter, o.service.name + ":chunks", {.high_water_mark = 4096});
  const auto endpoint = blocks.bind(o.service.bind, o.service.insecure);
  if (!endpoint) {
    log::error("{}", endpoint.error().text);
    return 2;
  }
  net::MasterLink link(context, o.service.master,
                       make_hello(o, **store, net::announced(*endpoint, o.service.advertise)));
  const auto status = [&] {
    return net::MasterLink::Values{{"rss_mb", net::resident_mb()},
                                   {"peak_rss_mb", net::peak_resident_mb()},
                                   {"messages_rejected", double(blocks.rejected())}};
  };

  const auto answer = [&](const std::string& peer, const auto& request) {
    if constexpr (std::is_same_v<std::decay_t<decltype(request)>, wire::ChunkListRequest>) {
      blocks.send(wire::ChunkList{request.epoch, (*store)->chunks()}, peer);
    } else {
      const bool exists = request.chunk.value < (*store)->chunks().size();
      const auto bytes = exists ? (*store)->chunk(request.chunk) : geometry::ChunkBytes{};
      blocks.send(wire::Chunk{request.epoch, request.chunk, bytes.bytes}, peer);
    }
  };
  while (!net::stop_requested() && !link.shutdown_requested()) {
    const double now = monotonic_s();
    link.tick(now, status);
    net::wait_readable({&blocks, &link.socket()}, 50);
    while (const auto message = link.socket().receive())
      if (!link.handle(*message, monotonic_s())) link.socket().reject(*message, "its type is not expected here");
    for (int n = 0; n < 64; ++n) {
      const auto message = blocks.receive();
      if (!message) break;
      net::dispatch<wire::ChunkListRequest, wire::ChunkRequest>(
          blocks, *message, [&](const auto& request) { answer(message->peer, request); });
    }
  }
  link.leave(status);
  return 0;
}

}  // namespace telesplat::data
