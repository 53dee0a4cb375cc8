#include "services/data/volume/flags.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

namespace telesplat::data {

bool VolumeFlags::any_but_raw() const {
  return !transfer.empty() || !lighting.empty() || !part.empty() || series_rate || cache_mb;
}

void add_volume_flags(CLI::App& app, VolumeFlags& f) {
  const std::string group = "Volumes";
  app.add_option(
         "--raw", f.raw,
         "layout of a file that does not tell: SIZExSIZExSIZE:TYPE[:SPACING,SPACING,SPACING], TYPE one of u8, i8, "
         "u16, i16, f32")
      ->group(group);
  app.add_option("--tf", f.transfer,
                 "transfer function: a preset (--list-tf), a ParaView colour map (.json), or points "
                 "VALUE:#RRGGBB:OPACITY,... with values in the data's units or per cent of their range; default: a "
                 "preset that fits")
      ->group(group);
  app.add_option("--lighting", f.lighting, "on: voxels are shaded by their gradients; off: they are not; default: on")
      ->group(group)
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option(
         "--series-rate", f.series_rate,
         "steps a second of a numbered series; 0: it does not play; default: all steps in a second, at most 12.5 "
         "a second")
      ->group(group)
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--part", f.part, "I/N: this server has the part I (from 0) of N of the volume's slices; default: all")
      ->group(group);
  app.add_option("--volume-cache-mb", f.cache_mb, "memory for the steps of a series; default: 2048")
      ->group(group)
      ->check(CLI::Range(16, 1 << 20));
  app.add_flag_callback(
         "--list-tf",
         [] {
           std::fputs(describe_transfer_presets().c_str(), stdout);
           throw CLI::Success();
         },
         "tell the transfer functions there are and end")
      ->group(group);
}

VolumeOptions to_options(const VolumeFlags& f) {
  VolumeOptions out;
  out.raw = f.raw, out.transfer = f.transfer, out.part = f.part;
  out.lit = f.lighting != "off";
  out.steps_per_s = f.series_rate;
  out.cache_mb = f.cache_mb.value_or(out.cache_mb);
  return out;
}

std::string describe_transfer_presets() {
  std::string out;
  for (const auto& preset : volume::transfer_presets()) out += fmt::format("{:10} {}\n", preset.name, preset.text);
  return out;
}

}  // namespace telesplat::data
