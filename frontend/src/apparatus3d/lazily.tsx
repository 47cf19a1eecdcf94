import { Skeleton } from "@mantine/core";
import { lazy, Suspense } from "react";

// Three dimensions weigh as much as half of the page. They come where they are looked at, after what is needed first.
const StationApparatus = lazy(() => import("./StationApparatus"));
const RecordingApparatus = lazy(() => import("./RecordingApparatus"));

const HEIGHT = 560;
const waiting = <Skeleton h={HEIGHT} aria-label="The apparatus is being drawn" />;

export function LiveApparatus() {
  return (
    <Suspense fallback={waiting}>
      <StationApparatus />
    </Suspense>
  );
}

export function RecordingGhost({ recordingId }: { recordingId: string }) {
  return (
    <Suspense fallback={waiting}>
      <RecordingApparatus recordingId={recordingId} />
    </Suspense>
  );
}
