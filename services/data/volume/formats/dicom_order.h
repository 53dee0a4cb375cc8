// Where the slices of a DICOM series lie: which of them make a volume, in which order, and what lies between them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/data/volume/formats/dicom_header.h"

namespace telesplat::data {

/// A layer of a volume: a slice, or a mixture of two neighbours.
struct DicomLayer {
  size_t below = 0, above = 0;  ///< places in DicomOrder::slices
  double share = 0;             ///< of the one above; 0: the one below alone
};

struct DicomOrder {
  std::vector<DicomSlice> slices;              ///< those that are used
  std::vector<std::vector<DicomLayer>> steps;  ///< time steps of equally many layers, along the slices' normal
  glm::dvec3 origin{0}, step{0};               ///< mm: of layer 0, and from one to the next
  std::string remark;                          ///< for people: what was left out, mixed or evened; often empty
};

/// Orders the slices of one series (at least one). Takes those that have the commonest size, spacing and orientation;
/// localizers only if there is nothing else. Leaves out copies: the same SOP Instance UID and frame, or a place
/// where same_pixels() finds no difference. Slices at one place become time steps if all places have equally many. A
/// layer that is missing is mixed from its neighbours by their distance; slices at uneven distances are resampled.
/// Slices without positions go by number.
DicomOrder order_slices(std::vector<DicomSlice> slices,
                        const std::function<bool(const DicomSlice&, const DicomSlice&)>& same_pixels);

}  // namespace telesplat::data
