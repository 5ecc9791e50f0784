// Makes the header of a final image, which describes the job.
#pragma once

#include "common/image/exr/final_image.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

// Reads the scene if the image has cryptomattes, which need the scene's names.
Provenance provenance_of(const ReportFacts& facts, const BlobStore& blobs);

}  // namespace ls::coordinator
