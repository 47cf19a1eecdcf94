import { Button, Card, Group, Stack, Text } from "@mantine/core";
import { IconCircle, IconCircleCheckFilled } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { api, type Check, type Schemas } from "../../../lib/api/client";
import { formatClock } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { useLive } from "../../../lib/live/hooks";
import { replaceData } from "../../../lib/replaceData";
import { translateServerText } from "../../../lib/serverText";
import { ProblemNote } from "../../../ui/ProblemNote";
import { StepActions } from "../../../ui/StepActions";
import { useHasPermission, useUserName } from "../../auth/hooks";
import { IDENTIFIERS_NEEDED, type Identifier, IdentityChoice } from "./IdentityChoice";
import { CheckPicture } from "./pictures";

const POLL_MS = 1000;
const mark = { size: 34, style: { flex: "none" } };

/**
 * Query the session's checklist for a recording. It polls while checks are open, because some are made
 * elsewhere.
 */
export function useChecklist(sessionId: string | undefined, recordingId: string | null) {
  return useQuery({
    queryKey: ["session", sessionId, "checklist", recordingId],
    queryFn: () => api.checklist(sessionId ?? "", recordingId),
    enabled: sessionId !== undefined,
    refetchInterval: (query) => (query.state.data?.complete ? false : POLL_MS),
  });
}

/**
 * Query the checklist before teaching. It polls while the apparatus has not detected everything, and is queried
 * again when the apparatus was turned, because the emergency stop must then be tested again.
 */
export function useTeachingChecklist(patientId: string, fixtures: Schemas["TeachRequest"]["fixtures"]) {
  const apparatusSide = useLive("side");
  return useQuery({
    queryKey: ["session", "teaching", patientId, fixtures, apparatusSide],
    queryFn: () => api.teachingChecklist(patientId, fixtures),
    refetchInterval: (query) =>
      query.state.data?.checks.some((check) => check.detected && !check.given) ? POLL_MS : false,
  });
}

/**
 * Shows one line per check, readable from a distance. Checks that the user makes have a button; the apparatus
 * detects the others.
 */
export function PreflightChecklist(props: {
  sessionId: string;
  recordingId: string | null;
  onlyOpen?: boolean;
  /** Called after the press that completes the checklist. */
  onComplete?: () => void;
  /** The button that leads to the next step, beside the number of confirmed checks. */
  next?: ReactNode;
}) {
  const { sessionId, recordingId, onlyOpen = false, onComplete, next } = props;
  const who = useUserName();
  const writes = useHasPermission("write_records");
  const queries = useQueryClient();
  const checklist = useChecklist(sessionId, recordingId);
  const [identifiers, setIdentifiers] = useState<Identifier[]>([]);
  const confirm = useMutation({
    mutationFn: async (checks: Check[]) => {
      for (const { check } of checks) {
        const saved = await api.confirmCheck(sessionId, check, {
          checked_by: who,
          recording_id: recordingId,
          ...(check === "identity" && { identifiers }),
        });
        replaceData(queries, ["session", sessionId, "checklist", recordingId], saved);
        if (saved.complete) onComplete?.();
      }
    },
    onSettled: () => void queries.invalidateQueries({ queryKey: ["session"] }),
  });
  const checks = (checklist.data?.checks ?? []).filter((check) => !onlyOpen || !check.given);
  const manual = writes ? checks.filter((check) => !check.given && !check.detected) : [];
  // The identity needs a separate answer, which says which identifiers agree.
  const toConfirm = manual.filter(({ check }) => check !== "identity");
  const identity = manual.find(({ check }) => check === "identity");
  return (
    <Stack gap="sm">
      {checks.map((check) => (
        <CheckLine
          key={check.check}
          check={check}
          below={
            check === identity &&
            checklist.data && (
              <Group justify="space-between" align="end">
                <IdentityChoice
                  patient={checklist.data.patient}
                  chosen={identifiers}
                  onChange={setIdentifiers}
                />
                <Button
                  size="lg"
                  disabled={confirm.isPending || identifiers.length < IDENTIFIERS_NEEDED}
                  onClick={() => confirm.mutate([check])}
                >
                  {t("station:identity.confirm")}
                </Button>
              </Group>
            )
          }
        >
          {toConfirm.includes(check) && (
            <Button
              size="lg"
              ml="auto"
              variant={toConfirm.length > 1 ? "default" : "filled"}
              disabled={confirm.isPending}
              aria-label={t("station:wizard.confirmCheck", {
                check: translateServerText(check.sentence, check.sentence_key),
              })}
              onClick={() => confirm.mutate([check])}
            >
              {t("station:wizard.confirm")}
            </Button>
          )}
        </CheckLine>
      ))}
      <ProblemNote error={checklist.error ?? confirm.error} />
      {/* After the checks, so that a user sees all of them before the confirmation. */}
      {toConfirm.length > 1 && (
        <Button size="lg" ml="auto" disabled={confirm.isPending} onClick={() => confirm.mutate(toConfirm)}>
          {t("station:wizard.confirmAll", { count: toConfirm.length })}
        </Button>
      )}
      {next && (
        <StepActions>
          <ConfirmedCount checks={checklist.data?.checks} />
          {next}
        </StepActions>
      )}
    </Stack>
  );
}

function ConfirmedCount({ checks }: { checks: Check[] | undefined }) {
  if (!checks) return null;
  return (
    <Text fw={600} role="status">
      {t("station:wizard.confirmedOf", {
        confirmed: checks.filter(({ given }) => given).length,
        count: checks.length,
      })}
    </Text>
  );
}

/** Shows one check with its picture, its sentence, and the person who confirmed it. */
export function CheckLine(props: { check: Check; children?: ReactNode; below?: ReactNode }) {
  const { check, children, below } = props;
  return (
    <Card withBorder padding="sm" data-testid={`check-${check.check}`}>
      <Group justify="space-between">
        <Group wrap="nowrap" gap="sm" flex="1 1 16rem">
          {check.given ? <IconCircleCheckFilled {...mark} /> : <IconCircle {...mark} />}
          <CheckPicture check={check} />
          <div>
            <Text size="lg">{translateServerText(check.sentence, check.sentence_key)}</Text>
            <Text size="sm">{describeState(check)}</Text>
          </div>
        </Group>
        {children}
      </Group>
      {below}
    </Card>
  );
}

/** Return what the user must do so that the apparatus detects the check. */
const howTo = (check: Check["check"]) =>
  check === "pedal" || check === "estop" ? t(`station:howToConfirm.${check}`) : "";

function describeState(check: Check): string {
  if (!check.given)
    return check.detected
      ? t("station:wizard.notDetected") + howTo(check.check)
      : t("station:wizard.notConfirmed");
  const at = check.checked_at ? formatClock(new Date(check.checked_at)) : "";
  return check.checked_by
    ? t("station:wizard.confirmedBy", { who: check.checked_by, at })
    : t("station:wizard.detected", { at });
}
