import { Stack, Title } from "@mantine/core";
import { t } from "../../lib/i18n";
import { useHasPermission } from "../auth/hooks";
import classes from "./home.module.css";
import {
  BackupTile,
  BreakGlassAccessesTile,
  CommissioningTile,
  StopsTile,
  StorageTile,
  TrackingTile,
  UnsignedTile,
  UsageTile,
} from "./managementTiles";
import { AdherenceTile, ImprovedTile } from "./outcomeTiles";

/** Key figures of the clinic. Each tile links to the page behind its figure. */
export function HomeTiles() {
  const canReadRecords = useHasPermission("read_records");
  const canSeeOperation = useHasPermission("see_operation");
  const canAdminister = useHasPermission("administer");
  return (
    <Stack component="section" aria-label={t("home:keyFigures")} gap="sm">
      <Title order={2} size="h4">
        {t("home:keyFigures")}
      </Title>
      <div className={classes.tiles}>
        {canReadRecords && <ImprovedTile />}
        {canReadRecords && <AdherenceTile />}
        {canSeeOperation && <UsageTile />}
        {canSeeOperation && <StopsTile />}
        {canSeeOperation && <TrackingTile />}
        {canAdminister && <UnsignedTile />}
        {canAdminister && <BreakGlassAccessesTile />}
        {canAdminister && <BackupTile />}
        {canSeeOperation && <CommissioningTile />}
        {canSeeOperation && <StorageTile />}
      </div>
    </Stack>
  );
}
