import "./catalogue";
import { Button, FileInput, Group, SegmentedControl, Stack, Text, TextInput } from "@mantine/core";
import { IconFileImport } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { MotorRanges } from "../../ui/MotorRanges";
import { ReachMargin } from "../../ui/ReachMargin";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { useUserName } from "../auth/hooks";
import { Refused } from "./Refused";

type Side = "left" | "right";

/** Imports a motion from a CSV file as a recording, after a preview. */
export function ImportMotion({
  patientId,
  side: affected,
  onSaved,
}: {
  patientId: string;
  side: Side | null;
  onSaved: (recordingId: string) => void;
}) {
  const queries = useQueryClient();
  const userName = useUserName();
  const [file, setFile] = useState<File | null>(null);
  const [name, setName] = useState("");
  const [side, setSide] = useState<Side>(affected ?? "right");
  const preview = useMutation({
    mutationFn: ({ csv, side }: { csv: File; side: Side }) => api.previewMotion(patientId, side, csv),
  });
  const save = useMutation({
    mutationFn: (csv: File) => api.importMotion(patientId, { name, side, taught_by: userName }, csv),
    onSuccess: ({ recording }) => {
      void queries.invalidateQueries({ queryKey: ["recordings"] });
      onSaved(recording.id);
    },
  });
  const choose = (chosen: File | null, forSide: Side) => {
    setFile(chosen);
    setSide(forSide);
    save.reset();
    if (chosen) {
      setName((before) => before || chosen.name.replace(/\.csv$/i, ""));
      preview.mutate({ csv: chosen, side: forSide });
    } else preview.reset();
  };
  return (
    <Stack>
      <Text>{t("import-export:motion.layout")}</Text>
      <SegmentedControl
        size="md"
        aria-label={t("import-export:motion.shoulder")}
        value={side}
        onChange={(chosen) => choose(file, chosen as Side)}
        data={[
          { value: "left", label: t("import-export:motion.sides.left") },
          { value: "right", label: t("import-export:motion.sides.right") },
        ]}
      />
      <FileInput
        label={t("import-export:motion.file")}
        placeholder={t("import-export:file.choose")}
        size="md"
        accept=".csv,text/csv"
        leftSection={<IconFileImport size={20} />}
        value={file}
        onChange={(chosen) => choose(chosen, side)}
      />
      <Refused error={save.error ?? preview.error} />
      {file && preview.data && <MotionSummary motion={preview.data} />}
      <TextInput
        label={t("import-export:motion.name")}
        size="md"
        maxLength={100}
        value={name}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group justify="end">
        <Button
          disabled={!file || !preview.data || name.trim() === ""}
          loading={save.isPending || preview.isPending}
          onClick={() => file && save.mutate(file)}
        >
          {t("import-export:motion.save")}
        </Button>
      </Group>
    </Stack>
  );
}

/** Shows the motion as the service read it, so that the user can compare it with the intended motion. */
function MotionSummary({ motion }: { motion: Schemas["UnderstoodMotion"] }) {
  return (
    <Stack gap="xs" data-testid="understood">
      <Text>
        {t(`import-export:motion.summary.${motion.layout}.${motion.side}`, {
          rows: motion.samples,
          hz: motion.rate_hz,
          duration: formatDuration(motion.duration_s),
        })}
        {motion.left_alone.length > 0 && t("import-export:motion.ignored", { columns: motion.left_alone })}
      </Text>
      <SimulatedBadge simulated={motion.simulated} />
      <MotorRanges ranges={motion.ranges} />
      <ReachMargin margin={motion.margin} />
    </Stack>
  );
}
