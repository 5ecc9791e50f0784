// The rows of the list that tests answer without a picture: sums, counters, refusals, what surfaces and
// cameras do to single rays.
#include "cli/cases/case.h"

namespace ls::cases {

const std::vector<Elsewhere>& answered_elsewhere() {
  static const std::vector<Elsewhere> rows = {
      {"N6", "tests/unit/render/sampler_test.cpp", "UnitFloat, StaysBelowOne"},
      {"N6", "tests/unit/render/sampler_test.cpp", "Exponential, IsTheLogarithmToTheLastPlacesAtBothEnds"},
      {"N11", "tests/unit/render/grid_test.cpp", "CellWalk, TellsTheVoxelsOfASmallGridApartFromAfar"},
      {"N12", "tests/unit/render/grid_test.cpp", "CellWalk, CoversTheRaysPartInTheDomainOnceAndInOrder"},
      {"N13", "tests/unit/render/grid_test.cpp", "CellWalk, MajorantDepthDoesNotDependOnHowARayIsCut"},
      {"N18", "tests/unit/sampling/phases_test.cpp", "Phases, SamplesFallAsTheDensitySays"},
      {"N18", "tests/unit/render/phase_test.cpp", "HenyeyGreenstein, IsNormalisedAndItsMeanCosineIsG"},
      {"N20", "tests/unit/render/numerics_test.cpp", "Frame, IsOrthonormalWhereverTheNormalPoints"},
      {"N20", "tests/unit/render/numerics_test.cpp",
       "Directions, KeepTheirLengthOverAHundredThousandScatterings"},
      // There are no tabulated phase functions.
      {"N21", "tests/system/test_validation_table.py", "test_tabulated_phase_functions_are_refused_by_name"},
      {"N30", "tests/unit/render/envmap_sampling_test.cpp",
       "EnvironmentMap, TheFirstAndTheLastWordMeanPlacesWithLight"},
      {"N31", "tests/unit/render/lights_tree_test.cpp",
       "LightTree, CopesWithLightsInOnePlaceAndWithExtremes"},
      {"N33", "tests/unit/bsdf/hand_values_test.cpp", "Roughness, BelowTheSpecularLimitIsAMirror"},
      {"N34", "tests/unit/bsdf/hand_values_test.cpp", "Roughness, StaysFiniteAtEveryExtreme"},
      {"N35", "tests/unit/bsdf/sampling_test.cpp", "Sampling, WeightTimesDensityIsTheValue"},
      {"N36", "tests/unit/bsdf/hand_values_test.cpp", "Dielectric, OfEqualIndicesIsNotThere"},
      {"N36", "tests/unit/bsdf/hand_values_test.cpp", "Dielectric, ReflectsTotallyBeyondTheCriticalAngle"},
      {"N37", "tests/unit/render/geometry_test.cpp",
       "Normals, ShadingFrameIsRightHandedAndAgreesWithTheGeometricNormal"},
      {"N38", "tests/unit/bsdf/energy_test.cpp", "Energy, NoSurfaceGivesMoreThanItGets"},
      {"N39", "tests/unit/render/geometry_test.cpp", "ClosedShapes, LoseNoRayAtAnyScale"},
      {"N41", "tests/unit/render/overlap_test.cpp", "Overlaps, AreRightWhereManyFacesLieOnEachOther"},
      {"N43", "tests/unit/render/overlap_test.cpp", "Overlaps, AreAroundTheCameraToo"},
      {"N44", "tests/unit/render/instance_test.cpp", "Instances, ThatCannotBePlacedAreRefused"},
      {"N44", "tests/unit/render/instance_test.cpp", "Instances, KeepOutsideOutsideWhenMirrored"},
      {"N45", "tests/unit/bsdf/texture_test.cpp",
       "Bitmap, RefusesTexelsThatAreNotFiniteAndCountsNegativeOnes"},
      {"N45", "tests/unit/bsdf/texture_test.cpp", "Bitmap, IsSafeForAnyCoordinate"},
      {"N46", "tests/unit/bsdf/bump_test.cpp", "BumpMap, WhereNothingSaysWhichWayUAndVRunIsFlat"},
      {"N47", "tests/unit/render/camera_test.cpp",
       "Camera, AThinLensWithoutAnApertureIsAPinholeToTheLastBit"},
      {"N48", "tests/unit/render/camera_test.cpp", "Camera, ExtremeFieldsOfViewGiveUnitDirections"},
      {"N49", "tests/unit/image/sums_test.cpp", "Sums, OfMoreOnesThanFloat32CountsAreExact"},
      {"N49", "tests/unit/image/sums_test.cpp", "Sums, OfTenthsDriftByNoMoreThanTheirRounding"},
      {"N50", "tests/unit/image/error_estimate_test.cpp", "ErrorEstimate, SumsOfTilesAreThoseOfTheImage"},
      {"N50", "tests/unit/image/error_estimate_test.cpp",
       "ErrorEstimate, EqualHalvesHaveNoErrorAndAreBelievedOnlyAfterSomeSamples"},
      {"N51", "tests/unit/image/film_test.cpp", "Film, IsTheSameWhateverOrderTheTilesComeIn"},
      {"N51", "tests/unit/image/merge_test.cpp",
       "Merge, GivesTheFilmOfTheCoordinatorWhateverTheOrderOfFiles"},
      {"N51", "tests/unit/image/merge_test.cpp", "Merge, DropsEqualDuplicatesAndCountsThem"},
      {"N52", "tests/unit/image/final_image_test.cpp", "FinalExr, ClampsToTheLargestHalfAndCounts"},
      {"N53", "tests/unit/image/error_estimate_test.cpp", "ErrorEstimate, CountsFirefliesInFull"},
      {"N53", "tests/unit/image/error_estimate_test.cpp",
       "ErrorEstimate, HeavyTailsGetAVerdictInsteadOfTrust"},
      {"N54", "tests/unit/render/health_test.cpp",
       "Health, SamplesTooLargeToBeAddedUpAreCountedAndContributeNothing"},
      {"N55", "tests/unit/render/sampler_test.cpp", "SampleStream, SamplesBeyondTheSequenceAreDrawnByHash"},
      {"N56", "tests/unit/render/sampler_test.cpp",
       "SampleStream, PixelsHalvesSeedsVerticesAndPurposesAreUncorrelated"},
      {"N56", "tests/unit/render/sampler_test.cpp", "SampleStream, NoKeyRepeatsOverAJobOfAMillionNumbers"},
      {"N57", "tests/unit/assemble/assemble_test.cpp", "Report, HasEveryKeyOfTheContract"},
      {"N59", "tests/unit/render/boundary_test.cpp", "Boundaries, RejectSamplesWhoseShadowRaysAreCutOff"},
      {"N59", "tests/unit/bsdf/texture_test.cpp", "Checkerboard, MayHoldOthersAsDeepAsTheReaderLetsThem"},
      {"N62", "tests/unit/scene/spectrum_test.cpp", "Spectra, WhatReflectsAllIsWhiteUnderD65"},
      {"N63", "tests/unit/image/final_image_test.cpp", "Preview, ShowsNaNInMagentaAndInfinitiesAtTheEnds"},
      {"N66", "tests/unit/render/glow_test.cpp",
       "BlackBody, IsDarkWhereItIsColdAndNeverMoreThanRayleighAndJeans"},
      // Nothing moves.
      {"N68", "tests/system/test_validation_table.py", "test_shutters_that_mean_nothing_are_warned_of"},
      {"N69", "tests/statistical/overlaps.cpp", "Two identical media of half the density"},
  };
  return rows;
}

}  // namespace ls::cases
