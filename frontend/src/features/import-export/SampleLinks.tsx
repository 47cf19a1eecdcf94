import { Button, Group } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { t } from "../../lib/i18n";

const KINDS = {
  recordings: ["csv", "parquet", "mcap"],
  runs: ["csv", "parquet", "mcap", "lerobot"],
} as const;

/** Links to download the measured samples as CSV, Parquet and MCAP, and those of a run as a LeRobotDataset. */
export function SampleLinks({
  of,
  id,
  disabled = false,
}: {
  of: "recordings" | "runs";
  id: string;
  disabled?: boolean;
}) {
  return (
    <Group gap="xs">
      {KINDS[of].map((kind) => (
        <Button
          key={kind}
          component="a"
          variant="default"
          href={`/api/${of}/${id}/samples.${kind === "lerobot" ? "lerobot.zip" : kind}`}
          leftSection={<IconDownload size={20} />}
          disabled={disabled}
        >
          {t(`import-export:file.${kind}`)}
        </Button>
      ))}
    </Group>
  );
}
