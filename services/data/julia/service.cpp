#include "services/data/julia/service.h"

#include <cstdio>

#include "common/core/clock.h"
#include "common/net/master_link.h"

namespace telesplat::data {
namespace {

constexpr double kQuiet_s = 2;  // what takes longer tells how far it is

int refuse(const Error& error) {
  std::fprintf(stderr, "telesplat: %s\n", error.text.c_str());
  return 2;
}

wire::Hello make_hello(const DataServiceOptions& o, const julia::Scene& scene, const julia::Placement& placement) {
  wire::Hello hello;
  hello.role = "data";
  hello.name = o.service.name;
  hello.facts = {{"kind", "julia"}, {"scene", scene.title}};
  if (!scene.timeline.empty()) hello.facts["animate"] = scene.timeline.text();
  hello.parameters = julia::to_map(scene.parameters);
  hello.parameters.merge(julia::to_map(placement));
  hello.box_room = placement.box_room;
  return hello;
}

}  // namespace

int run_julia(const DataServiceOptions& o) {
  if (o.julia.list_presets) {
    std::fputs(julia::describe_presets().c_str(), stdout);
    return 0;
  }
  const auto scene = julia::read_scene(o.julia);
  if (!scene) return refuse(scene.error());
  const double begin_s = monotonic_s();
  const auto placement = julia::place(*scene, o.mesh.room_size_m, [&](size_t done, size_t of) {
    if (monotonic_s() - begin_s < kQuiet_s) return;
    if (o.report_progress) {
      std::printf("progress looking for the set %.3f\n", double(done) / double(of));
      std::fflush(stdout);
    } else {
      log::info("looking for the set: {} of {} instants", done, of);
    }
  });
  if (!placement) return refuse(placement.error());
  const auto& c = scene->parameters.c;
  log::info("{}: c = ({}, {}, {}, {}), {} iterations, {:.3f} units a metre; placed in {:.0f} ms", scene->title, c.x,
            c.y, c.z, c.w, scene->parameters.iterations, 1 / placement->scale, 1e3 * (monotonic_s() - begin_s));

  net::install_signal_handlers();
  net::Context context;
  net::MasterLink link(context, o.service.master, make_hello(o, *scene, *placement));
  const auto status = [&] {
    return net::MasterLink::Values{{"rss_mb", net::resident_mb()}, {"peak_rss_mb", net::peak_resident_mb()}};
  };
  while (!net::stop_requested() && !link.shutdown_requested()) {
    link.tick(monotonic_s(), status);
    net::wait_readable({&link.socket()}, 50);
    while (const auto message = link.socket().receive())
      if (!link.handle(*message, monotonic_s())) link.socket().reject(*message, "its type is not expected here");
  }
  link.leave(status);
  return 0;
}

}  // namespace telesplat::data
