import { SimpleGrid, Stack, Title } from "@mantine/core";
import { t } from "../../lib/i18n";
import { useHasPermission } from "../auth/hooks";
import { AdherenceTile, ImprovedTile } from "./outcomeTiles";
import {
  BackupTile,
  CommissioningTile,
  EmergencyTile,
  StopsTile,
  StorageTile,
  TrackingTile,
  UsageTile,
} from "./serviceTiles";

/** Key figures of the clinic. Each tile links to the page behind its figure. */
export function ClinicTiles() {
  const reads = useHasPermission("read_records");
  const oversees = useHasPermission("see_operation");
  const administers = useHasPermission("administer");
  return (
    <Stack component="section" aria-label={t("clinic:home.clinic")} gap="sm">
      <Title order={2} size="h4">
        {t("clinic:home.clinic")}
      </Title>
      <SimpleGrid cols={{ base: 1, xs: 2, lg: 4 }}>
        {reads && <ImprovedTile />}
        {reads && <AdherenceTile />}
        {oversees && <UsageTile />}
        {oversees && <StopsTile />}
        {oversees && <TrackingTile />}
        {administers && <EmergencyTile />}
        {administers && <BackupTile />}
        {oversees && <CommissioningTile />}
        {oversees && <StorageTile />}
      </SimpleGrid>
    </Stack>
  );
}
