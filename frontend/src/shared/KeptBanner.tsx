import { Text } from "@mantine/core";
import { useConnected, useLive } from "../live/hooks";
import { formatClock } from "./format";
import classes from "./Shell.module.css";
import { KEPT } from "./words";

/** The database is away, or has not been told everything yet: on every page, beside what the apparatus does. */
export function KeptBanner() {
  const connected = useConnected();
  const kept = useLive("kept");
  if (!connected || !kept) return null;
  const since = kept.away_since ? formatClock(new Date(kept.away_since)) : null;
  if (kept.not_kept_since) {
    return (
      <Text className={classes.lost ?? ""} role="alert" data-testid="kept" data-kept="no">
        {KEPT.diskFull(formatClock(new Date(kept.not_kept_since)))}
      </Text>
    );
  }
  if (since === null) return null;
  return (
    <Text className={classes.kept ?? ""} role="status" data-testid="kept" data-kept="yes">
      {KEPT.away(since)}
    </Text>
  );
}
