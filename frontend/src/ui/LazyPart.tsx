import { Text } from "@mantine/core";
import { CatchBoundary } from "@tanstack/react-router";
import { type ReactNode, Suspense } from "react";
import { t } from "../lib/i18n";

interface LazyPartProps {
  children: ReactNode;
  /** Shown while the module of `children` loads. */
  loading: ReactNode;
  /** Shown if the module does not load or `children` fail. By default a sentence that says so. */
  failed?: ReactNode;
}

/** A part of a page that loads on demand. If it fails, as without a connection, the rest of the page with Stop stays. */
export function LazyPart({ children, loading, failed }: LazyPartProps) {
  return (
    <CatchBoundary getResetKey={() => ""} errorComponent={() => failed ?? <NotLoaded />}>
      <Suspense fallback={loading}>{children}</Suspense>
    </CatchBoundary>
  );
}

function NotLoaded() {
  return <Text role="status">{t("common:part.notLoaded")}</Text>;
}
