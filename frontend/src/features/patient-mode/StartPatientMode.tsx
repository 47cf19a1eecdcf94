import { Button, Modal, Radio, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconDeviceTablet } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { LANGUAGE } from "../../lib/language";
import { ProblemNote } from "../../ui/ProblemNote";
import { authStore } from "../auth/authState";
import { useMe } from "../auth/hooks";

/** Gives this browser with a questionnaire to the patient. */
export function StartPatientMode({ episodeId }: { episodeId: string }) {
  const [opened, dialog] = useDisclosure(false);
  return (
    <>
      <Button variant="default" leftSection={<IconDeviceTablet size={20} />} onClick={dialog.open}>
        {t("patient-mode:start.open")}
      </Button>
      <Modal opened={opened} onClose={dialog.close} title={t("patient-mode:start.open")}>
        <ChooseQuestionnaire episodeId={episodeId} />
      </Modal>
    </>
  );
}

function ChooseQuestionnaire({ episodeId }: { episodeId: string }) {
  const me = useMe();
  const [chosen, setChosen] = useState<string | null>(null);
  const questionnaires = useQuery({ queryKey: ["questionnaires"], queryFn: api.questionnaires });
  const ready = questionnaires.data?.items.filter((one) => one.languages.includes(LANGUAGE)) ?? [];
  const start = useMutation({
    mutationFn: (questionnaire: string) =>
      api.startPatientMode(episodeId, { questionnaire, language: LANGUAGE }),
    onSuccess: () => authStore.refresh(),
  });
  if (questionnaires.data && ready.length === 0) return <Text>{t("patient-mode:start.noTexts")}</Text>;
  return (
    <Stack>
      <ProblemNote error={questionnaires.error ?? start.error} />
      <Radio.Group label={t("patient-mode:start.choose")} value={chosen} onChange={setChosen}>
        <Stack gap="xs" mt="xs">
          {ready.map((one) => (
            <Radio key={one.code} value={one.code} label={one.title} size="md" />
          ))}
        </Stack>
      </Radio.Group>
      <Text size="sm">{t("patient-mode:start.explanation", { name: me?.name ?? "" })}</Text>
      <Button
        size="lg"
        disabled={chosen === null}
        loading={start.isPending}
        onClick={() => chosen && start.mutate(chosen)}
      >
        {t("patient-mode:start.begin")}
      </Button>
    </Stack>
  );
}
